import { describe, expect, it } from 'vitest';

import { newPassword, passwordFault } from '../../src/words/password_words';

describe('what is wrong with a password', () => {
  it.each([
    ['eleven 7777', '', 'Too short: 1 more.'],
    ['', '', 'Too short: 12 more.'],
    ['twelve 12345', '', ''],
    ['x'.repeat(256), '', ''],
    ['x'.repeat(257), '', 'Too long: at most 256 characters.'],
    ['the older one', 'the older one', 'This is the old password: choose another one.'],
    ['a newer one 1', 'the older one', ''],
  ])('%j after %j: %j', (password, old, fault) => {
    expect(passwordFault(password, old)).toBe(fault);
  });

  it('counts what a person counts as one sign as one', () => {
    expect(passwordFault('🛩'.repeat(11))).toBe('Too short: 1 more.');
    expect(passwordFault('🛩'.repeat(256))).toBe('');
  });
});

describe('a first password', () => {
  const filledWith = (byte: (at: number) => number): string =>
    newPassword((bytes) => bytes.forEach((_, at) => (bytes[at] = byte(at))));

  it('is four groups of five letters that cannot be mistaken', () => {
    expect(newPassword()).toMatch(/^([a-km-np-z2-9]{5}-){3}[a-km-np-z2-9]{5}$/);
    expect(passwordFault(newPassword())).toBe('');
  });

  it('is made of the random bytes it is given, each letter equally often', () => {
    expect(filledWith(() => 0)).toBe('aaaaa-aaaaa-aaaaa-aaaaa');
    expect(filledWith((at) => at)).not.toBe(filledWith((at) => at + 1));
    const letters = new Set(Array.from({ length: 256 }, (_, byte) => filledWith(() => byte)[0]));
    expect(letters.size).toBe(32);
  });
});
