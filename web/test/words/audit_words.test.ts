import { expect, it } from 'vitest';

import { detailWords } from '../../src/words/audit_words';

it('names what has a name, and leaves its id out', () => {
  const detail = { token_id: 4, token: 'Night script', user_id: 3, user: 'admin', scopes: 'watch', limits: { m: 60 } };
  expect(detailWords(detail)).toBe('token: Night script, user: admin, scopes: watch, limits: {"m":60}');
});

it('keeps an id that stands alone', () => {
  expect(detailWords({ session_id: 9 })).toBe('session id: 9');
});

it('says moments as everywhere, yes or no, and nothing of what has no value', () => {
  const detail = { user: 'alice', until: '2026-11-24T23:50:13.084084+00:00', may_arm: false, max_height_m: null };
  expect(detailWords(detail)).toBe('user: alice, until: 2026-11-24 23:50, may arm: no');
});
