import { expect, it } from 'vitest';

import { dateMinute, fromNow, span } from '../../src/words/dates';

it('says a span as exactly as a reader needs it', () => {
  const hour = 3600;
  const table: [number, string][] = [
    [-3, '0 s'],
    [59.9, '59 s'],
    [60, '1 min'],
    [hour - 1, '59 min'],
    [hour, '1 h'],
    [5 * hour - 1, '4 h 59 min'],
    [48 * hour - 1, '47 h 59 min'],
    [48 * hour, '2 d'],
    [72 * hour - 1, '2 d 23 h'],
  ];
  for (const [seconds, words] of table) expect(span(seconds)).toBe(words);
});

it('tells what is over from what is to come', () => {
  const now = Date.parse('2026-03-04T05:06:07Z');
  expect(fromNow('2026-03-04T05:06:06Z', now)).toBe('over');
  expect(fromNow('2026-03-04T06:36:07Z', now)).toBe('in 1 h 30 min');
});

it('leaves seconds away, and says a dash for what it does not know', () => {
  expect(dateMinute('2026-03-04T05:06:07Z')).toBe('2026-03-04 05:06');
  expect(dateMinute(null)).toBe('–');
});
