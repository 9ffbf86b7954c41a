import { beforeEach, describe, expect, it } from 'vitest';

import { PadCalibration } from '../../src/link/pad_calibration';
import { padAxes } from '../../src/link/pad_source';
import { SLOTS } from '../../src/link/stick_modes';
import { DEFAULT_PAD, DEFAULT_SETTINGS, withPad } from '../../src/link/stick_settings';
import { CENTRED } from '../../src/link/sticks';
import { pad } from './pads';
import { Hands, type Device } from './recorded_pads';

/** Its own order of axes, the right stick's Y reversed and short, a trigger at rest at -1, a switch, a knob. */
const DEVICE: Device = {
  id: 'P',
  mapping: '',
  sticks: {
    leftX: { axis: 3, ends: [0.9, 0.01, -0.8] },
    leftY: { axis: 2, ends: [0.8, 0, -0.9] },
    rightX: { axis: 0, ends: [0.8, 0.02, -0.7] },
    rightY: { axis: 1, ends: [-0.7, -0.03, 0.8] },
  },
  others: {
    4: { before: -1, used: [1, -1], slides: true },
    5: { before: 0, used: [1], slides: false },
    6: { before: 0, used: [0.9], slides: true },
  },
  buttons: 4,
};
const [TRIGGER, SWITCH, KNOB] = [4, 5, 6];

let calibration: PadCalibration;
let hands: Hands;
beforeEach(() => {
  calibration = new PadCalibration();
  hands = new Hands(DEVICE, ({ axes }, nowMs) => calibration.take(axes, nowMs));
});

function find(): void {
  hands.wait(1_000);
  for (const slot of SLOTS) {
    hands.move(slot, 1);
    hands.move(slot, 0);
  }
}
function goRound(): void {
  for (const slot of SLOTS) for (const share of [1, -1, 0]) hands.move(slot, share);
}

describe('calibration', () => {
  it('learns rest, order, direction and travel', () => {
    find();
    goRound();
    expect(calibration.finish()).toBe(true);
    hands.wait(1_000);
    const result = calibration.result(DEFAULT_PAD)!;
    expect(result.isCalibrated).toBe(true);
    expect(result.slots.rightY).toEqual({
      axis: 1,
      isInverted: true,
      low: -0.7,
      centre: expect.closeTo(-0.03) as number,
      high: 0.8,
    });
    const settings = withPad(DEFAULT_SETTINGS, hands.pad, result);
    expect(padAxes(hands.pad, settings)).toEqual(CENTRED);
    hands.move('leftY', 1);
    hands.move('rightY', 1);
    expect(padAxes(hands.pad, settings)).toEqual({ ...CENTRED, throttle: 1, pitch: 1 });
  });

  it('wants the sticks at rest before it begins', () => {
    for (let time = 0; time < 8; time++) {
      for (const slot of SLOTS) hands.move(slot, time % 2 ? 0 : 0.7);
    }
    expect(calibration.step.name).toBe('rest');
    hands.wait(1_000);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftX' });
  });

  it('wants the stick back before it looks for the next, and takes no axis twice', () => {
    hands.wait(1_000);
    hands.move('leftX', 1);
    expect(calibration.waitsForRest).toBe(true);
    hands.move('leftY', 1);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftX' });
    hands.move('leftY', 0);
    hands.move('leftX', 0);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
    hands.move('leftX', -1);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
    hands.move('leftY', -1);
    hands.move('leftY', 0);
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' }); // the left stick is still held aside
    hands.move('leftX', 0);
    expect(calibration.step).toEqual({ name: 'find', slot: 'rightX' });
  });

  it('says why an axis is no stick', () => {
    hands.wait(1_000);
    for (const [axis, why] of [
      [TRIGGER, 'end'],
      [SWITCH, 'jumps'],
      [KNOB, 'stays'],
    ] as const) {
      hands.use(axis);
      hands.wait(2_500);
      expect(calibration.complaint).toEqual({ axis, why });
      expect(calibration.step).toEqual({ name: 'find', slot: 'leftX' });
    }
    expect([TRIGGER, SWITCH, KNOB].map((axis) => calibration.roleOf(axis))).toEqual(['end', 'stays', 'stays']);
    hands.move('leftX', 1);
    expect(calibration.complaint).toBeNull();
    expect(calibration.roleOf(3)).toBe('leftX');
  });

  it('takes a throttle that was left at its end once it is back in its middle', () => {
    hands.wait(1_000);
    hands.move('leftX', 1);
    hands.move('leftX', 0);
    hands.move('leftY', 1);
    hands.wait(2_500);
    expect(calibration.complaint).toEqual({ axis: 2, why: 'stays' });
    hands.move('leftY', 0);
    hands.wait(1_000);
    hands.move('leftY', 1);
    expect(calibration.roleOf(2)).toBe('leftY');
  });

  it('takes no throttle that rested at its end at first', () => {
    hands.values[2] = -0.9;
    hands.wait(1_000);
    hands.move('leftX', 1);
    hands.move('leftX', 0);
    hands.move('leftY', 1);
    expect(calibration.complaint).toEqual({ axis: 2, why: 'end' });
    expect(calibration.step).toEqual({ name: 'find', slot: 'leftY' });
  });

  it('does not end before every stick was at all its ends and is back at rest', () => {
    find();
    expect(calibration.unfinished).toEqual(SLOTS);
    expect(calibration.finish()).toBe(false);
    hands.move('leftX', 1);
    expect(calibration.unfinished).toEqual(SLOTS);
    hands.move('leftX', -1);
    expect(calibration.unfinished).toEqual(SLOTS.slice(1));
    goRound();
    hands.move('rightX', 1);
    expect(calibration.finish()).toBe(true);
    hands.wait(3_000);
    expect(calibration.step.name).toBe('back');
    expect(calibration.result(DEFAULT_PAD)).toBeNull();
    hands.move('rightX', 0);
    hands.wait(1_000);
    expect(calibration.step.name).toBe('done');
  });

  it('begins anew with another device', () => {
    find();
    expect(calibration.step.name).toBe('range');
    calibration.take(pad([0, 0, 0, 0]).axes, hands.nowMs);
    expect(calibration.step.name).toBe('rest');
  });
});
