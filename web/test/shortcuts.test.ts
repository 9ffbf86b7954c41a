import { describe, expect, it } from 'vitest';

import { SHORTCUTS, shortcutOf } from '../src/shortcuts';

const press = (key: string, more = {}) =>
  shortcutOf({ key, ctrlKey: false, metaKey: false, altKey: false, repeat: false, ...more });

describe('shortcuts', () => {
  it('are one key each, and leave the sticks of the keyboard alone', () => {
    const keys = SHORTCUTS.map(({ key }) => key);
    expect(new Set(keys).size).toBe(keys.length);
    expect(new Set(SHORTCUTS.map(({ name }) => name)).size).toBe(keys.length);
    expect(keys.filter((key) => 'wasdWASD'.includes(key) || key.startsWith('Arrow'))).toEqual([]);
  });

  it('are told apart by Shift, and are none with a modifier or held down', () => {
    expect([press('i'), press('I'), press('?')]).toEqual(['arm', 'disarm', 'help']);
    expect([press('r', { ctrlKey: true }), press('l', { metaKey: true }), press('h', { altKey: true })]).toEqual([
      null,
      null,
      null,
    ]);
    expect([press('l', { repeat: true }), press('w'), press('q')]).toEqual([null, null, null]);
  });
});
