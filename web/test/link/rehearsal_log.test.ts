import { describe, expect, it } from 'vitest';

import { nextRehearsal } from '../../src/link/rehearsal_log';
import type { RehearsalEvent } from '../../src/link/wire_types';

const event = (phase: string, text: string, hold_ms: number | null = null): RehearsalEvent => ({
  type: 'rehearsal',
  drone_id: 1,
  what: 'tower',
  phase,
  hold_ms,
  text,
  lasts_s: 4,
});

describe('what is seen of a rehearsal', () => {
  it('keeps the measured time and the words about it when it is over', () => {
    const begun = nextRehearsal(null, event('begun', 'begun'));
    const held = nextRehearsal(begun, event('held', 'In LOITER', 2003));
    expect(held).toMatchObject({ phase: 'held', hold_ms: 2003, isRunning: true });
    expect(nextRehearsal(held, event('ended', 'over'))).toMatchObject({
      phase: 'ended',
      hold_ms: 2003,
      text: 'In LOITER',
      isRunning: false,
    });
  });

  it.each(['failed', 'not_needed'])('keeps that it %s, and that another may begin only when it is over', (phase) => {
    const outcome = nextRehearsal(null, event(phase, 'no hold'));
    expect(outcome).toMatchObject({ phase, isRunning: true });
    const over = nextRehearsal(outcome, event('ended', 'over'));
    expect(over).toMatchObject({ phase, text: 'no hold', isRunning: false });
    expect(nextRehearsal(over, event('begun', 'again'))).toMatchObject({ phase: 'begun', text: 'again' });
  });

  it('takes an end without a beginning', () => {
    expect(nextRehearsal(null, event('ended', 'over'))).toMatchObject({ text: 'over', isRunning: false });
  });
});
