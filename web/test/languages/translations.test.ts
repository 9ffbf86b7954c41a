import { describe, expect, it } from 'vitest';

import { faultsOf, isTranslated, offeredLanguages, type Message } from '../../scripts/texts/translations.mjs';
import { OFFERED } from '../../src/languages/languages';

const messages = new Map<string, Message>([
  ['Hold {drone}', { names: ['drone'], isPlural: false }],
  ['{n} drones', { names: ['n'], isPlural: true }],
]);
const faults = (translations: Record<string, string | Record<string, string>>): string[] =>
  faultsOf('pt', messages, new Map(Object.entries(translations)));

describe('translations', () => {
  it('have no faults when placeholders and forms are right', () => {
    expect(
      faults({ 'Hold {drone}': 'Parar {drone}', '{n} drones': { one: '{n} drone', other: '{n} drones' } }),
    ).toEqual([]);
    expect(faults({ '{n} drones': { one: 'um drone', other: '{n} drones', many: '{n} de drones' } })).toEqual([]);
  });

  it.each([
    [{ 'Hold {drone}': 'Parar' }, 'lacks {drone}'],
    [{ 'Hold {drone}': 'Parar {drone} {now}' }, 'has {now}'],
    [{ 'Hold {drone}': { one: 'Parar {drone}', other: 'Parar {drone}' } }, 'does not count'],
    [{ '{n} drones': '{n} drones' }, 'needs plural forms'],
    [{ '{n} drones': { other: '{n} drones' } }, 'lacks "one"'],
    [{ '{n} drones': { one: '{n} drone', few: '{n} drones', other: '{n} drones' } }, 'no plural form "few"'],
    [{ 'Not in the console': 'Nada' }, 'nobody uses'],
  ])('%j has a fault', (translations, words) => {
    expect(faults(translations as Record<string, string>).join('\n')).toContain(words);
  });

  it('that are empty are lacking, and no fault', () => {
    expect(faults({ 'Hold {drone}': '' })).toEqual([]);
    expect([undefined, '', { one: 'x', other: '' }, {}].map(isTranslated)).toEqual([false, false, false, false]);
    expect(['x', { one: 'x', other: 'y' }].map(isTranslated)).toEqual([true, true]);
  });

  it('of an offered language must be complete: the check reads the same list', () => {
    expect([...offeredLanguages()]).toEqual([...OFFERED]);
  });
});
