import { expect, it } from 'vitest';

import { ANY_FLIGHT, flightFileHref, readFlights } from '../../src/link/flights';
import { Rest } from '../../src/link/rest';

it('asks for what the filter says, and for the next page', async () => {
  const asked: string[] = [];
  const rest = new Rest((path) => {
    asked.push(path);
    return Promise.resolve(Response.json({ flights: [], next: '5-7' }));
  });
  expect((await readFlights(rest, ANY_FLIGHT)).next).toBe('5-7');
  const since = '2026-11-22T09:00:00.000Z';
  await readFlights(rest, { droneId: 4, pilot: ' alice ', fromIso: since, untilIso: '' }, '5-7');
  const [first, second] = asked.map((path) => new URL(path, 'http://tower'));
  expect([first!.pathname, first!.search]).toEqual(['/api/v1/flights', '']);
  expect(Object.fromEntries(second!.searchParams)).toEqual({ drone_id: '4', pilot: 'alice', since, before: '5-7' });
});

it('knows where each file is', () => {
  expect(flightFileHref(7, 'tlog')).toBe('/api/v1/flights/7/tlog');
  expect(flightFileHref(7, 'kml')).toBe('/api/v1/flights/7/export/kml');
});
