import { expect, it } from 'vitest';

import { backoffMs } from '../../src/link/backoff';

it('doubles up to eight seconds, however often it failed', () => {
  const waits = [1, 2, 3, 4, 5, 6, 1e6].map((failures) => backoffMs(failures, () => 1));
  expect(waits).toEqual([500, 1_000, 2_000, 4_000, 8_000, 8_000, 8_000]);
});

it('is spread over the second half of it', () => {
  expect([0, 0.5, 1].map((chance) => backoffMs(3, () => chance))).toEqual([1_000, 1_500, 2_000]);
  const waits = Array.from({ length: 200 }, () => backoffMs(5));
  expect(Math.min(...waits)).toBeGreaterThanOrEqual(4_000);
  expect(Math.max(...waits)).toBeLessThanOrEqual(8_000);
  expect(new Set(waits).size).toBeGreaterThan(100);
});
