import { describe, expect, it } from 'vitest';

import { identityWords } from '../../src/words/identity_words';

describe('by what a drone is known', () => {
  it('is the beginning of its fingerprint, and since when', () => {
    const identity = {
      kind: 'key',
      fingerprint: 'SHA256:0123456789abcdefghijklmnopqrstuvwxyzABCDEFG',
      since: '2026-03-04T05:06:07Z',
    } as const;
    expect(identityWords(identity)).toBe('SHA256:0123456789ab…, since 2026-03-04 05:06');
  });

  it.each([
    ['credential', 'a credential, until its next sign-in'],
    ['none', 'not enrolled'],
  ] as const)('is %s: "%s"', (kind, words) => {
    expect(identityWords({ kind, fingerprint: null, since: null })).toBe(words);
  });

  it('is nothing of a tower that does not say', () => {
    expect(identityWords(undefined)).toBe('');
  });
});
