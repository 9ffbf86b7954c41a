import { describe, expect, it } from 'vitest';

import { CENTRED } from '../../src/link/sticks';
import { TouchSticks } from '../../src/link/touch_sticks';

const LEFT = 11;
const RIGHT = 12;

describe('touch sticks', () => {
  it('are two, and one thumb each', () => {
    const sticks = new TouchSticks({ mode: 2, throttleSprings: true });
    sticks.press('left', LEFT, { x: 0, y: 1 });
    sticks.press('right', RIGHT, { x: -1, y: 0 });
    sticks.press('left', 13, { x: 1, y: -1 });
    sticks.move(13, { x: 1, y: -1 });
    expect(sticks.read()).toEqual({ ...CENTRED, throttle: 1, roll: -1 });
    sticks.release(LEFT);
    expect(sticks.read()).toEqual({ ...CENTRED, roll: -1 });
    sticks.releaseAll();
    expect(sticks.read()).toEqual(CENTRED);
    sticks.move(RIGHT, { x: 1, y: 1 });
    expect(sticks.read()).toEqual(CENTRED);
  });

  it('let the throttle stay where the pilot wants that, in every mode', () => {
    for (const [mode, side] of [
      [1, 'right'],
      [2, 'left'],
      [3, 'right'],
      [4, 'left'],
    ] as const) {
      const sticks = new TouchSticks({ mode, throttleSprings: false });
      sticks.press(side, LEFT, { x: 1, y: -1 });
      sticks.release(LEFT);
      expect(sticks.read()).toEqual({ ...CENTRED, throttle: -1 });
    }
  });

  it('do not go beyond their ends, nor anywhere by what is no number', () => {
    const sticks = new TouchSticks({ mode: 2, throttleSprings: true });
    sticks.press('right', RIGHT, { x: 5, y: -5 });
    sticks.move(RIGHT, { x: NaN, y: 0 });
    expect(sticks.read()).toEqual({ ...CENTRED, roll: 1, pitch: -1 });
  });
});
