import { describe, expect, it } from 'vitest';

import { manualControlFields } from '../../src/link/manual';
import { axesOf, axisAt, SLOTS, STICK_MODES } from '../../src/link/stick_modes';
import { rcValue, shaped, travelled } from '../../src/link/stick_shaping';
import { AXIS_NAMES, CENTRED } from '../../src/link/sticks';

const STEPS = [...Array(401).keys()].map((step) => step / 200 - 1);

describe('shaping', () => {
  it('has a dead zone without a step at its edge, and keeps the ends', () => {
    const shape = { deadZone: 0.1, expo: 0 };
    expect([0, 0.1, -0.1].map((value) => shaped(value, shape))).toEqual([0, 0, 0]);
    expect(shaped(0.1001, shape)).toBeCloseTo(0, 3);
    expect(shaped(0.55, shape)).toBeCloseTo(0.5);
    expect([shaped(1, shape), shaped(-1, shape), shaped(7, shape)]).toEqual([1, -1, 1]);
  });

  it('is gentler round the middle with expo', () => {
    expect(shaped(0.5, { deadZone: 0, expo: 1 })).toBeCloseTo(0.125);
    expect(shaped(0.5, { deadZone: 0, expo: 0.5 })).toBeCloseTo(0.3125);
    expect(shaped(1, { deadZone: 0, expo: 1 })).toBe(1);
  });

  it.each([0, 0.3, 0.7, 1])('is odd, never falls and stays within -1..1 with expo %s', (expo) => {
    const shape = { deadZone: 0.07, expo };
    const out = STEPS.map((value) => shaped(value, shape));
    for (const [at, value] of out.entries()) {
      expect(Math.abs(value)).toBeLessThanOrEqual(1);
      expect(value).toBeGreaterThanOrEqual(out[at - 1] ?? -1);
      expect(value).toBeCloseTo(-out[out.length - 1 - at]!);
    }
  });

  it('measures each half of the travel by itself', () => {
    const travel = { low: -0.8, centre: 0.1, high: 0.9 };
    expect(travelled(0.1, travel)).toBe(0);
    expect(travelled(0.5, travel)).toBeCloseTo(0.5);
    expect(travelled(-0.35, travel)).toBeCloseTo(-0.5);
    expect([travelled(0.9, travel), travelled(-0.8, travel)]).toEqual([1, -1]);
    expect([travelled(2, travel), travelled(-2, travel)]).toEqual([1, -1]);
    expect(travelled(0.5, { low: 0, centre: 0, high: 0 })).toBe(0);
  });
});

describe('what is sent', () => {
  it('is 500 * axis + 1500 as a pulse', () => {
    expect([-1, -0.5, 0, 0.25, 1, 9].map(rcValue)).toEqual([1000, 1250, 1500, 1625, 2000, 2000]);
  });

  it('means the same as MANUAL_CONTROL', () => {
    for (const axis of STEPS) {
      const fields = manualControlFields({ ...CENTRED, throttle: axis, roll: axis }, 1);
      expect(Math.abs(fields.z! - (rcValue(axis) - 1000))).toBeLessThanOrEqual(1);
      expect(Math.abs(fields.y! - 2 * (rcValue(axis) - 1500))).toBeLessThanOrEqual(1);
    }
  });
});

describe('stick modes', () => {
  const sticks = { leftX: 0.1, leftY: 0.2, rightX: 0.3, rightY: 0.4 };

  it.each([
    [1, { yaw: 0.1, pitch: 0.2, roll: 0.3, throttle: 0.4 }],
    [2, { yaw: 0.1, throttle: 0.2, roll: 0.3, pitch: 0.4 }],
    [3, { roll: 0.1, pitch: 0.2, yaw: 0.3, throttle: 0.4 }],
    [4, { roll: 0.1, throttle: 0.2, yaw: 0.3, pitch: 0.4 }],
  ] as const)('mode %s', (mode, axes) => {
    expect(axesOf(mode, sticks)).toEqual(axes);
  });

  it.each(STICK_MODES)('mode %s gives each axis one slot', (mode) => {
    expect(SLOTS.map((slot) => axisAt(mode, slot)).sort()).toEqual([...AXIS_NAMES].sort());
  });
});
