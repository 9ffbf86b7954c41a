import { describe, expect, it } from 'vitest';

import { distanceM, offsetBy } from '../../src/link/geometry';
import { distance, duration, fixed, plain, UNKNOWN } from '../../src/words/format';

describe('numbers for people', () => {
  it('say when they are not known', () => {
    expect([fixed(null), fixed(NaN, 1), duration(null), distance(null)]).toEqual(Array(4).fill(UNKNOWN));
  });
  it('have a real minus sign and no minus zero', () => {
    expect([fixed(-1.25, 1), fixed(-0.04, 1), fixed(12.34, 1)]).toEqual(['−1.3', '0.0', '12.3']);
  });
  it('of time and distance are short', () => {
    expect([duration(3_725_000), duration(59_999), distance(999), distance(1234)]).toEqual([
      '62:05',
      '00:59',
      '999 m',
      '1.23 km',
    ]);
  });
});

describe('numbers for machines', () => {
  it('are plain', () => expect([plain(-1.256), plain(10), plain(null)]).toEqual(['-1.26', '10', '']));
});

describe('distance', () => {
  it.each([0, 47.4, -33.9, 69])('agrees with going there, at latitude %f', (latDeg) => {
    const from = { latDeg, lonDeg: 8.5 };
    expect(distanceM(from, offsetBy(from, 300, -400))).toBeCloseTo(500, 0);
  });
});
