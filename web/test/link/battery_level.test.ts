import { describe, expect, it } from 'vitest';

import { batteryLevel } from '../../src/link/battery_level';

describe('a battery is judged by the thresholds of its autopilot', () => {
  it.each([
    ['low at 60 %, because its voltage is', 60, 2, 'low'],
    ['critical', 60, 3, 'critical'],
    ['an emergency', 60, 4, 'critical'],
    ['well at 25 %, below our own limit', 25, 1, null],
    ['well by the autopilot, but nearly empty', 12, 1, 'low'],
    ['charging', 10, 7, 'critical'],
  ] as const)('%s', (_, batteryPercent, batteryCharge, expected) => {
    expect(batteryLevel({ batteryPercent, batteryCharge })).toBe(expected);
  });

  it.each([
    [31, null],
    [30, 'low'],
    [15, 'critical'],
    [null, null],
  ] as const)('and by ours where it reports none: %s %%', (batteryPercent, expected) => {
    expect(batteryLevel({ batteryPercent, batteryCharge: null })).toBe(expected);
    expect(batteryLevel({ batteryPercent, batteryCharge: 0 })).toBe(expected);
  });
});
