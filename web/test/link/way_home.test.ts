import { describe, expect, it } from 'vitest';

import { afterWayHome, type WayHomeFacts } from '../../src/link/way_home';

const HOME = { latDeg: 47, lonDeg: 8 };
const MINUTES = 60_000;
const FACTS: WayHomeFacts = {
  airborne: true,
  batteryTime: { leftMs: 10 * MINUTES, isEstimate: false },
  place: { latDeg: 47.01, lonDeg: 8 },
  home: HOME,
  homeDistanceM: 600,
  altRelM: 10,
  groundSpeedMps: 0,
  wind: null,
  positionAgeMs: 200,
  batteryAgeMs: 900,
};
const seconds = (changes: Partial<WayHomeFacts>): number | null => {
  const { afterMs } = afterWayHome({ ...FACTS, ...changes });
  return afterMs === null ? null : Math.round(afterMs / 1000);
};
const why = (changes: Partial<WayHomeFacts>): string => {
  const found = afterWayHome({ ...FACTS, ...changes });
  return found.afterMs === null ? found.why : 'known';
};

describe('the time after the way home', () => {
  it('takes the way at a usual speed while it hovers, and the landing', () => {
    // 600 m at 5 m/s, 10 m down at 0.5 m/s.
    expect(seconds({})).toBe(600 - 120 - 20);
    expect(seconds({ altRelM: 40 })).toBe(600 - 120 - 40);
  });

  it('takes the ground speed while it moves', () => {
    expect(seconds({ groundSpeedMps: 10 })).toBe(600 - 60 - 20);
    expect(seconds({ groundSpeedMps: 2 })).toBe(600 - 120 - 20);
  });

  it('counts a wind against it, and none from behind', () => {
    expect(seconds({ wind: { fromDeg: 180, mps: 2 } })).toBe(600 - 200 - 20);
    expect(seconds({ wind: { fromDeg: 0, mps: 2 } })).toBe(600 - 120 - 20);
    expect(seconds({ wind: { fromDeg: 180, mps: 30 } })).toBe(600 - 1200 - 20);
  });

  it('is negative when the battery does not last', () => {
    expect(seconds({ batteryTime: { leftMs: MINUTES, isEstimate: true } })).toBe(60 - 140);
  });

  it.each<[string, Partial<WayHomeFacts>]>([
    ['on the ground', { airborne: false }],
    ['not known whether it flies', { airborne: null }],
    ['its values are old', { positionAgeMs: 11_000 }],
    ['its values are old', { batteryAgeMs: null }],
    ['its consumption is not known yet', { batteryTime: null }],
    ['its home is not known', { homeDistanceM: null }],
    ['its home is not known', { altRelM: null }],
  ])('is unknown: %s', (expected, changes) => {
    expect(why(changes)).toBe(expected);
  });
});
