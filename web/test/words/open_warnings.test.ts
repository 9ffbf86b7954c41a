import { describe, expect, it } from 'vitest';

import { openWarnings, type BeforeTakeOff } from '../../src/words/open_warnings';
import { anAlert } from '../link/fakes';

const line = (key: string, state: 'good' | 'caution' | 'bad' | 'unknown') => ({ key, state, title: key, words: 'so' });
const list = (...lines: ReturnType<typeof line>[]) => ({ lines, own: [], signed: null });
const read = (changes: Partial<BeforeTakeOff>): string[] =>
  openWarnings({ preflight: list(), lossCheck: null, alerts: [], ...changes });

describe('what is open before take-off', () => {
  it('is every line that is not good, the worst first', () => {
    const preflight = list(
      line('gps', 'unknown'),
      line('battery', 'caution'),
      line('link', 'good'),
      line('home', 'bad'),
    );
    expect(read({ preflight })).toEqual(['home: so', 'battery: so', 'gps: so']);
  });

  it('begins with the alerts that last, without notices', () => {
    const alerts = [anAlert({ words: 'The battery is low.' }), anAlert({ severity: 'notice', words: 'It holds.' })];
    expect(read({ alerts, preflight: list(line('gps', 'bad')) })).toEqual(['The battery is low.', 'gps: so']);
  });

  it('names the dangers of the check before flight, and not its line as well', () => {
    const danger = { about: 'radio', severity: 'danger', text: 'It sinks to the ground.' } as const;
    const lossCheck = {
      complete: true,
      sentences: [danger, { ...danger, severity: 'info', text: 'It holds.' } as const],
    };
    expect(read({ lossCheck, preflight: list(line('failsafes', 'bad')) })).toEqual(['It sinks to the ground.']);
    expect(read({ preflight: list(line('failsafes', 'caution')) })).toEqual(['failsafes: so']);
  });

  it('has the lines that nobody has confirmed, until they are signed', () => {
    const own = [{ text: 'Propellers', of: 'drone' as const }];
    expect(read({ preflight: { lines: [], own, signed: null } })).toEqual(['1 checklist item is not confirmed.']);
    const signed = { by: { id: 1, name: 'anna' }, at: '', weather: '' } as never;
    expect(read({ preflight: { lines: [], own, signed } })).toEqual([]);
  });

  it('is not nothing where the list could not be read', () => {
    expect(read({ preflight: null })).toEqual(['The preflight checklist could not be read.']);
  });
});
