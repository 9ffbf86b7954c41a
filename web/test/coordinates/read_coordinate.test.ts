import { describe, expect, it } from 'vitest';

import { readCoordinate } from '../../src/coordinates/read_coordinate';

describe('a coordinate', () => {
  it.each([
    ['47.397742, 8.545594', 47.397742, 8.545594],
    ['47.397742 8.545594', 47.397742, 8.545594],
    ['-33.8568; 151.2153', -33.8568, 151.2153],
    ['47.397742N 8.545594E', 47.397742, 8.545594],
    ['33.8568° S, 151.2153° E', -33.8568, 151.2153],
    [`47°23'51.87"N 8°32'44.14"E`, 47.397742, 8.545594],
    ['47 23 51.87 N, 8 32 44.14 E', 47.397742, 8.545594],
    ['N47 23.8645 W8 32.7356', 47.397742, -8.545594],
    ['N 47°23.8645′ E 8°32.7356′', 47.397742, 8.545594],
    // A published pair, the CN Tower; and its mirror image in the south.
    ['17T 630084 4833438', 43.642567, -79.387139],
    ['17N 630084mE 4833438mN', 43.642567, -79.387139],
    ['17G 630084 5166562', -43.642567, -79.387139],
    // From the examples of the specification of plus codes.
    ['7FG49QCJ+2V', 20.3700625, 2.7821875],
    ['8fvc2222+22', 47.0000625, 8.0000625],
    ['4VCPPQGP+Q9', -41.2730625, 174.7859375],
    ['9C3W9QCJ+2VX', 51.3701125, -1.217765625],
    ['8FVC0000+', 47.5, 8.5],
  ])('is read from %s', (text, latDeg, lonDeg) => {
    const found = readCoordinate(text);
    expect(found!.latDeg).toBeCloseTo(latDeg, 4);
    expect(found!.lonDeg).toBeCloseTo(lonDeg, 4);
  });

  it('of a short plus code is the one nearest to what the map shows', () => {
    expect(readCoordinate('CJ+2VX')).toBeNull();
    const found = readCoordinate('CJ+2VX', { latDeg: 51.3708675, lonDeg: -1.217765625 })!;
    expect(found.latDeg).toBeCloseTo(51.3701125, 6);
    expect(found.lonDeg).toBeCloseTo(-1.217765625, 6);
    // Across the edge of the area whose digits it lacks.
    const beside = readCoordinate('22+22', { latDeg: 46.9999, lonDeg: 7.9999 })!;
    expect(beside.latDeg).toBeCloseTo(47.0000625, 6);
    expect(beside.lonDeg).toBeCloseTo(8.0000625, 6);
  });

  it.each([
    '',
    'Kestrel',
    '47.39',
    '91, 8',
    '47, 181',
    '47°61\'0"N 8°0\'0"E',
    '61T 500000 5000000',
    '32I 500000 5000000',
    '8FVC9G8F',
    '8FVC9G8F+6',
    '8FVC00G8+',
    '1 2 3',
  ])('is not read from "%s"', (text) => {
    expect(readCoordinate(text)).toBeNull();
  });
});
