import { describe, expect, it } from 'vitest';

import { rowWords, setupBlockedWords, type SetupSituation } from '../../src/words/receiver_words';
import type { User } from '../../src/link/wire_types';
import { A_DRONE } from '../link/fakes';

const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const MINE = { ...A_DRONE, holder: OLGA };
const ROW = { name: 'FS_OPTIONS', now: 16, wanted: 29, why: '', ok: false };

describe('a parameter of the set-up', () => {
  it.each([
    [ROW, '16 → 29'],
    [{ ...ROW, now: null }, '– → 29'],
    [{ ...ROW, now: 0.10000000149, wanted: 0.5 }, '0.1 → 0.5'],
    [{ ...ROW, now: 29, ok: true }, '29, stays'],
  ])('%j reads %s', (row, words) => {
    expect(rowWords(row)).toBe(words);
  });
});

describe('why it cannot be set now', () => {
  const said = (changes: Partial<SetupSituation>): string =>
    setupBlockedWords({ drone: MINE, user: OLGA, armed: false, isConnected: true, isKnown: true, ...changes });

  it('is nothing for who has the controls while it is disarmed', () => {
    expect(said({})).toBe('');
  });

  it.each<[string, Partial<SetupSituation>]>([
    ['connection', { isConnected: false }],
    ['offline', { drone: { ...MINE, online: false }, armed: null }],
    ['Take control of Heron', { drone: A_DRONE }],
    ['was read yet', { isKnown: false }],
    ['not known', { armed: null }],
    ['Disarm it first', { armed: true }],
  ])('is said: %s', (words, changes) => {
    expect(said(changes)).toContain(words);
  });
});
