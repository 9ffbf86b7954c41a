import { describe, expect, it } from 'vitest';

import { offsetBy } from '../../src/link/geometry';
import { wayThere } from '../../src/link/way_there';

const HOME = { latDeg: 47, lonDeg: 8 };
const FACTS = {
  airborne: true,
  batteryTime: { leftMs: 600_000, isEstimate: false },
  place: HOME,
  home: HOME,
  homeDistanceM: 0,
  altRelM: 10,
  groundSpeedMps: 0,
  wind: null,
  positionAgeMs: 100,
  batteryAgeMs: 100,
};
const north = (metres: number) => offsetBy(HOME, metres, 0);

describe('the way to a place', () => {
  it('takes as long as the longer of the way over the ground and the climb', () => {
    expect(wayThere(FACTS, north(100), 10)!.timeS).toBeCloseTo(20);
    expect(wayThere({ ...FACTS, groundSpeedMps: 10 }, north(100), 10)!.timeS).toBeCloseTo(10);
    expect(wayThere(FACTS, north(10), 60)!.timeS).toBeCloseTo(20);
    expect(wayThere({ ...FACTS, altRelM: 40 }, north(0), 10)!.timeS).toBeCloseTo(20);
  });

  it('leaves the battery less the way there, the way home from there, and the landing', () => {
    // 100 m at 5 m/s out and back, then 10 m down at 0.5 m/s.
    expect(wayThere(FACTS, north(100), 10)!.leftMs).toBeCloseTo(600_000 - 2 * 20_000 - 20_000, -2);
    expect(wayThere(FACTS, north(2000), 10)!.leftMs).toBeLessThan(0);
  });

  it('says nothing of what is not known', () => {
    expect(wayThere({ ...FACTS, place: null }, north(100), 10)).toBeNull();
    expect(wayThere({ ...FACTS, batteryTime: null }, north(100), 10)!.leftMs).toBeNull();
    expect(wayThere({ ...FACTS, home: null, homeDistanceM: null }, north(100), 10)!.leftMs).toBeNull();
  });
});
