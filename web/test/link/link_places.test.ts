import { expect, it } from 'vitest';

import {
  gradeOf,
  gradeRanges,
  linkPlacesHref,
  middleOf,
  placeAt,
  readLinkPlaces,
  worstFirst,
  type LinkPlace,
} from '../../src/link/link_places';
import type { Rest } from '../../src/link/rest';
import { EVER } from '../../src/link/statistics';

const place = (about: Partial<LinkPlace> = {}): LinkPlace => ({
  south: 47,
  west: 8,
  north: 47.001,
  east: 8.001,
  reports: 4,
  losses: 0,
  lossPercent: 1,
  rttMs: 60,
  rttMaxMs: 90,
  ...about,
});

it('reads the cells, and asks for what the page shows', async () => {
  const asked: unknown[] = [];
  const properties = { reports: 3, losses: 1, loss_mean: 0.125, rtt_median_ms: 80, rtt_max_ms: null };
  const ring = [
    [8, 47],
    [8.5, 47],
    [8.5, 47.5],
    [8, 47.5],
    [8, 47],
  ];
  const view = { features: [{ geometry: { coordinates: [ring] }, properties }], flights: 2, is_whole: false };
  const rest = {
    call: (...about: unknown[]) => {
      asked.push(about);
      return Promise.resolve(view);
    },
  } as unknown as Pick<Rest, 'call'>;
  const found = await readLinkPlaces(rest, { droneId: 7, fromIso: '', untilIso: '2026-05-01T00:00:00Z' }, 500);
  expect(asked).toEqual([
    ['GET', '/statistics/link-quality', { query: { drone_id: 7, until: '2026-05-01T00:00:00Z', cell_m: 500 } }],
  ]);
  expect(found).toEqual({
    flights: 2,
    isWhole: false,
    places: [
      {
        south: 47,
        west: 8,
        north: 47.5,
        east: 8.5,
        reports: 3,
        losses: 1,
        lossPercent: 12.5,
        rttMs: 80,
        rttMaxMs: null,
      },
    ],
  });
  expect(middleOf(found.places[0]!)).toEqual({ latDeg: 47.25, lonDeg: 8.25 });
});

it('downloads what is shown', () => {
  expect(linkPlacesHref(EVER, 100)).toBe('/api/v1/statistics/link-quality/csv?cell_m=100');
  expect(linkPlacesHref({ droneId: 7, fromIso: '2026-05-01T00:00:00Z', untilIso: '' }, 50)).toBe(
    '/api/v1/statistics/link-quality/csv?drone_id=7&since=2026-05-01T00%3A00%3A00Z&cell_m=50',
  );
});

it.each([
  ['loss', 0, 'good'],
  ['loss', 2, 'good'],
  ['loss', 2.1, 'fair'],
  ['loss', 20, 'poor'],
  ['loss', 20.1, 'bad'],
  ['loss', null, null],
  ['latency', 150, 'good'],
  ['latency', 151, 'fair'],
  ['latency', 500, 'poor'],
  ['latency', 501, 'bad'],
  ['latency', null, null],
] as const)('grades %s of %s as %s', (measure, value, grade) => {
  const other = measure === 'loss' ? { lossPercent: value, rttMs: 9000 } : { lossPercent: 90, rttMs: value };
  expect(gradeOf(place(other), measure)).toBe(grade);
});

it('has a range for each grade, without gaps', () => {
  expect(gradeRanges('loss')).toEqual([
    { grade: 'good', above: null, upTo: 2 },
    { grade: 'fair', above: 2, upTo: 8 },
    { grade: 'poor', above: 8, upTo: 20 },
    { grade: 'bad', above: 20, upTo: null },
  ]);
  expect(gradeRanges('latency').map(({ upTo }) => upTo)).toEqual([150, 300, 500, null]);
});

it('orders the worst first: where the link was only lost, then by figure, losses and reports, the unknown last', () => {
  const dead = place({ reports: 0, losses: 1, lossPercent: null, rttMs: null });
  const unknown = place({ reports: 1, lossPercent: null, rttMs: null });
  const high = place({ lossPercent: 30, rttMs: 50 });
  const slow = place({ lossPercent: 0, rttMs: 900 });
  const lost = place({ lossPercent: 0, rttMs: 50, losses: 2 });
  const often = place({ lossPercent: 0, rttMs: 50, reports: 9 });
  const places = [unknown, often, lost, slow, high, dead];
  expect(worstFirst(places, 'loss')).toEqual([dead, high, lost, often, slow, unknown]);
  expect(worstFirst(places, 'latency').slice(0, 2)).toEqual([dead, slow]);
  expect(places[0]).toBe(unknown);
});

it('finds the cell of a point, also on another copy of the world', () => {
  const places = [place(), place({ west: 8.001, east: 8.002 }), place({ west: 179.999, east: 180 })];
  expect(placeAt(places, { latDeg: 47.0005, lonDeg: 8.0015 })).toBe(places[1]);
  expect(placeAt(places, { latDeg: 47.0005, lonDeg: 8.0005 - 360 })).toBe(places[0]);
  expect(placeAt(places, { latDeg: 47.0005, lonDeg: 179.9995 + 360 })).toBe(places[2]);
  expect(placeAt(places, { latDeg: 47.002, lonDeg: 8.0005 })).toBeNull();
});
