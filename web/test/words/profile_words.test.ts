import { describe, expect, it } from 'vitest';

import { PROFILE_CHOICES, thinnedWords } from '../../src/words/profile_words';
import { A_DRONE } from '../link/fakes';

describe('the stream profile in words', () => {
  it.each([
    [null, '', ''],
    ['full', 'the link has been at ease for 20 s', ''],
    ['thin', '15% of the packets are lost', 'Thin stream: 15% of the packets are lost'],
    ['minimal', 'set by an admin', 'Minimal stream: set by an admin'],
    ['minimal', '', 'Minimal stream'],
  ] as const)('%s, because "%s"', (profile, profile_why, words) => {
    expect(thinnedWords({ ...A_DRONE, profile, profile_why })).toBe(words);
  });

  it('offers auto first and every profile', () => {
    expect(Object.keys(PROFILE_CHOICES)).toEqual(['auto', 'full', 'thin', 'minimal']);
  });
});
