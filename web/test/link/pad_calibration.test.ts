import { describe, expect, it } from 'vitest';

import { PadCalibration } from '../../src/link/pad_calibration';
import { padAxes } from '../../src/link/pad_source';
import { DEFAULT_PAD, DEFAULT_SETTINGS, withPad } from '../../src/link/stick_settings';
import { CENTRED } from '../../src/link/sticks';
import { pad } from './pads';

/** A transmitter: its own order of axes, the right stick's Y inverted, a trigger at rest at -1. */
const REST = [0.02, -0.03, 0, 0.01, -1, 0];
const at = (changes: Record<number, number>): number[] => REST.map((value, axis) => changes[axis] ?? value);
const [LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y, TRIGGER] = [3, 2, 0, 1, 4];

function feed(calibration: PadCalibration, axes: number[], beats = 1): void {
  for (let beat = 0; beat < beats; beat++) calibration.take(axes);
}

function found(): PadCalibration {
  const calibration = new PadCalibration();
  feed(calibration, REST, 60);
  for (const [axis, value] of [
    [LEFT_X, 0.9],
    [LEFT_Y, 0.9],
    [RIGHT_X, 0.9],
    [RIGHT_Y, -0.6],
  ] as const) {
    feed(calibration, at({ [axis]: value }), 3);
    feed(calibration, REST, 3);
  }
  return calibration;
}

describe('calibration', () => {
  it('learns rest, order, direction and travel', () => {
    const calibration = found();
    expect(calibration.step.name).toBe('range');
    for (const value of [-0.7, 0.8]) {
      feed(calibration, at({ [LEFT_X]: value, [LEFT_Y]: value, [RIGHT_X]: value, [RIGHT_Y]: value }));
    }
    expect(calibration.finish()).toBe(true);
    const result = calibration.result(DEFAULT_PAD)!;
    expect(result.isCalibrated).toBe(true);
    expect(result.slots.rightY).toEqual({ axis: RIGHT_Y, isInverted: true, low: -0.7, centre: -0.03, high: 0.8 });
    const settings = withPad(DEFAULT_SETTINGS, 'P', result);
    expect(padAxes(pad(REST), settings)).toEqual(CENTRED);
    expect(padAxes(pad(at({ [LEFT_Y]: 0.8, [RIGHT_Y]: -0.7 })), settings)).toEqual({
      ...CENTRED,
      throttle: 1,
      pitch: 1,
    });
  });

  it('wants the sticks at rest before it begins', () => {
    const calibration = new PadCalibration();
    for (let beat = 0; beat < 200; beat++) calibration.take(at({ [LEFT_X]: (beat % 7) / 7 }));
    expect(calibration.step.name).toBe('rest');
    feed(calibration, REST, 60);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftX' });
  });

  it('wants the stick back before it looks for the next, and takes no axis twice', () => {
    const calibration = new PadCalibration();
    feed(calibration, REST, 60);
    feed(calibration, at({ [LEFT_X]: 1 }), 50);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
    expect(calibration.waitsForRest).toBe(true);
    feed(calibration, at({ [LEFT_X]: 1, [TRIGGER]: 1 }), 50);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
    feed(calibration, REST);
    feed(calibration, at({ [LEFT_X]: -1 }), 50);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
    feed(calibration, at({ [LEFT_Y]: -1 }));
    expect(calibration.step).toEqual({ name: 'find', slot: 'rightX' });
  });

  it('does not end before every stick was at all its ends', () => {
    const calibration = found();
    feed(calibration, at({ [LEFT_X]: 1, [LEFT_Y]: 1, [RIGHT_X]: 1, [RIGHT_Y]: 1 }));
    expect(calibration.progress).toBe(0.25); // the stick found last has been down already
    expect(calibration.finish()).toBe(false);
    expect(calibration.result(DEFAULT_PAD)).toBeNull();
    feed(calibration, at({ [LEFT_X]: -1, [LEFT_Y]: -1 }));
    expect(calibration.progress).toBe(0.75);
  });
});
