import { expect, it } from 'vitest';

import { csvHref, EVER, readLogBook, readStatistics, withoutGaps } from '../../src/link/statistics';
import type { Rest } from '../../src/link/rest';

const month = (name: string, hours = 1) => ({ month: name, flights: 1, hours });

it('fills months without a flight, over the turn of a year', () => {
  const shown = withoutGaps([month('2025-11', 2), month('2026-02', 3)]);
  expect(shown.map((one) => [one.month, one.hours])).toEqual([
    ['2025-11', 2],
    ['2025-12', 0],
    ['2026-01', 0],
    ['2026-02', 3],
  ]);
  expect(withoutGaps([])).toEqual([]);
  expect(withoutGaps([month('2026-12')])).toHaveLength(1);
});

it('downloads what is shown', () => {
  const period = { droneId: 7, fromIso: '2026-05-01T00:00:00Z', untilIso: '' };
  expect(csvHref('drones', EVER)).toBe('/api/v1/statistics/csv?by=drones');
  expect(csvHref('flights', period)).toBe(
    '/api/v1/statistics/csv?since=2026-05-01T00%3A00%3A00Z&by=flights&drone_id=7',
  );
  expect(csvHref('log-book', period)).toBe('/api/v1/log-book/csv?since=2026-05-01T00%3A00%3A00Z');
  expect(csvHref('log-book', EVER)).toBe('/api/v1/log-book/csv');
});

it('asks for the period and the drone; the log book is of all drones', async () => {
  const asked: unknown[] = [];
  const rest = {
    call: (...about: unknown[]) => {
      asked.push(about);
      return Promise.resolve({});
    },
  } as unknown as Pick<Rest, 'call'>;
  const period = { droneId: 7, fromIso: '', untilIso: '2026-05-01T00:00:00Z' };
  await readStatistics(rest, period);
  await readLogBook(rest, period);
  expect(asked).toEqual([
    ['GET', '/statistics', { query: { until: '2026-05-01T00:00:00Z', drone_id: 7 } }],
    ['GET', '/log-book', { query: { until: '2026-05-01T00:00:00Z' } }],
  ]);
});
