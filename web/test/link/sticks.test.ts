import { describe, expect, it } from 'vitest';

import { KeyboardSticks } from '../../src/link/keyboard_sticks';
import { CENTRED, offCentre } from '../../src/link/sticks';

describe('centred', () => {
  it('is a little off the middle too', () => {
    expect(offCentre({ ...CENTRED, yaw: -0.07 })).toEqual([]);
    expect(offCentre({ ...CENTRED, yaw: -0.2, roll: 1 })).toEqual(['yaw', 'roll']);
  });
});

describe('keys', () => {
  it('move the sticks with ramps, and let them spring back', () => {
    const keys = new KeyboardSticks();
    expect(keys.read(0)).toEqual(CENTRED);
    expect(keys.press('KeyW')).toBe(true);
    expect(keys.press('ArrowLeft')).toBe(true);
    const partly = keys.read(100);
    expect(partly.throttle).toBeCloseTo(0.2);
    expect(partly.roll).toBeCloseTo(-0.2);
    expect(keys.read(5_000)).toEqual({ ...CENTRED, throttle: 1, roll: -1 });
    keys.release('KeyW');
    expect(keys.read(5_100).throttle).toBeCloseTo(0.5);
    expect(keys.read(5_300)).toEqual({ ...CENTRED, roll: -1 });
  });

  it('that oppose each other cancel out', () => {
    const keys = new KeyboardSticks();
    keys.read(0);
    keys.press('ArrowUp');
    keys.press('ArrowDown');
    expect(keys.read(1_000)).toEqual(CENTRED);
  });

  it('are all up when the page says so', () => {
    const keys = new KeyboardSticks();
    keys.read(0);
    keys.press('KeyD');
    expect(keys.read(1_000).yaw).toBe(1);
    keys.releaseAll();
    expect(keys.read(1_020)).toEqual(CENTRED);
  });

  it('that may come up unheard of are let go, and their sticks spring back', () => {
    const keys = new KeyboardSticks();
    keys.read(0);
    keys.press('KeyW');
    expect(keys.read(1_000).throttle).toBe(1);
    keys.letGo();
    expect(keys.read(1_100).throttle).toBeCloseTo(0.5);
    expect(keys.read(1_300)).toEqual(CENTRED);
  });

  it('of other uses are left alone', () => {
    expect(new KeyboardSticks().press('Escape')).toBe(false);
    expect(new KeyboardSticks().press('toString')).toBe(false);
  });
});
