import { describe, expect, it } from 'vitest';

import { axesWith, padAxes, padSource, unready, usablePads, type PadLike } from '../../src/link/pad_source';
import {
  DEFAULT_PAD,
  DEFAULT_SETTINGS,
  padSettingsOf,
  withAxis,
  withPad,
  type ButtonAction,
} from '../../src/link/stick_settings';
import { CENTRED } from '../../src/link/sticks';
import { pad } from './pads';

describe('a standard pad that nobody has set up', () => {
  it('is read as mode 2, up and forward positive, with a dead zone', () => {
    const axes = padAxes(pad([1, -1, 0.05, -0.54]), DEFAULT_SETTINGS)!;
    expect(axes).toMatchObject({ yaw: 1, throttle: 1, roll: 0 });
    expect(axes.pitch).toBeCloseTo(0.5);
    expect(Object.is(padAxes(pad([0, 0, 0, 0]), DEFAULT_SETTINGS)!.throttle, 0)).toBe(true);
  });

  it('needs two sticks and a plug', () => {
    const good = pad([0, 0, 0, 0]);
    const pads = (): (PadLike | null)[] => [null, pad([0, 0]), pad([0, 0, 0, 0], { connected: false }), good];
    expect(usablePads(pads)).toEqual([good]);
  });

  it('is not guessed at when it says what is no number', () => {
    expect(padAxes(pad([0, NaN, 0, 0]), DEFAULT_SETTINGS)).toBeNull();
  });
});

describe('settings', () => {
  it('say which axis is which stick, how far it goes, and which way', () => {
    const own = {
      ...DEFAULT_PAD,
      isCalibrated: true,
      slots: { ...DEFAULT_PAD.slots, leftY: { axis: 5, isInverted: false, low: -0.5, centre: 0, high: 0.5 } },
      shapes: { ...DEFAULT_PAD.shapes, throttle: { deadZone: 0, expo: 0 }, pitch: { deadZone: 0, expo: 1 } },
    };
    const long = pad([0, 1, 0, -0.5, 0, 0.25]);
    const settings = withPad({ ...DEFAULT_SETTINGS, mode: 2 }, long, own);
    expect(padAxes(long, settings)).toEqual({ ...CENTRED, throttle: 0.5, pitch: 0.125 });
    expect(axesWith(pad([0, 1, 0, -0.5]), own, settings)).toBeNull(); // it no longer has that axis
    const mode1 = padAxes(long, { ...settings, mode: 1 })!;
    expect(mode1.pitch).toBeCloseTo(0.125);
    expect(mode1.throttle).toBeCloseTo(0.5);
  });
});

describe('a pad must be set up', () => {
  const standard = pad([0, 0, 0, 0, -1]);
  const other = { ...standard, mapping: '' };

  it('when two sticks are on one axis, or one on what is no stick', () => {
    const { slots } = DEFAULT_PAD;
    const shared = { ...DEFAULT_PAD, slots: { ...slots, leftX: slots.rightX } };
    expect(unready(standard, withPad(DEFAULT_SETTINGS, standard, shared))).toBe('shared-axis');
    const onTrigger = withAxis({ ...DEFAULT_PAD, isCalibrated: true }, 'leftY', 4);
    expect(unready(standard, withPad(DEFAULT_SETTINGS, standard, onTrigger))).toBe('no-stick');
    expect(unready(other, withPad(DEFAULT_SETTINGS, other, onTrigger))).toBe('unknown-layout');
  });

  it('not when its sticks trade places', () => {
    const own = { ...DEFAULT_PAD, isCalibrated: true };
    const measured = { ...own, slots: { ...own.slots, rightY: { ...own.slots.rightY, low: -0.6 } } };
    const swapped = withAxis(measured, 'leftY', 3);
    expect(swapped.slots.leftY).toEqual(measured.slots.rightY);
    expect(swapped.slots.rightY).toEqual(measured.slots.leftY);
    expect(unready(other, withPad(DEFAULT_SETTINGS, other, swapped))).toBeNull();
  });

  it('when its id was calibrated before layouts were noted, until it is calibrated again', () => {
    const old = { ...DEFAULT_SETTINGS, pads: { P: { ...DEFAULT_PAD, isCalibrated: true } } };
    expect([standard, other].map((one) => unready(one, old))).toEqual(['other-layout', 'other-layout']);
    const changed = withPad(old, standard, { ...DEFAULT_PAD, buttons: { 1: 'hold' } });
    expect(unready(standard, changed)).toBe('other-layout');
    const again = withPad(changed, standard, { ...DEFAULT_PAD, isCalibrated: true });
    expect([standard, other].map((one) => unready(one, again))).toEqual([null, 'other-layout']);
    expect(Object.keys(again.pads)).toHaveLength(1);
  });

  it('not for settings by hand of a standard pad from before', () => {
    const slots = { ...DEFAULT_PAD.slots, rightX: { ...DEFAULT_PAD.slots.rightX, isInverted: true } };
    const shapes = { ...DEFAULT_PAD.shapes, roll: { deadZone: 0, expo: 0 } };
    const old = { ...DEFAULT_SETTINGS, pads: { P: { ...DEFAULT_PAD, slots, shapes } } };
    expect(padAxes(pad([0, 0, 0.5, 0, -1]), old)).toEqual({ ...CENTRED, roll: -0.5 });
    expect(unready(other, old)).toBe('unknown-layout');
    expect(padSettingsOf(old, other)).toEqual({ ...DEFAULT_PAD, shapes }); // what the pilot likes goes with any layout
  });
});

describe('the source', () => {
  it('reads just this pad, and a pad that flaps is gone for good', () => {
    let pads: (PadLike | null)[] = [pad([0, -1, 0, 0])];
    const source = padSource(pads[0]!, () => pads, DEFAULT_SETTINGS);
    expect(source.read(0)).toEqual({ ...CENTRED, throttle: 1 });
    pads = [pad([0, 0, 0, 0], { id: 'another' })];
    expect(source.read(1)).toBeNull();
    pads = [pad([0, -1, 0, 0])];
    expect(source.read(2)).toBeNull();
  });

  it('tells which buttons went down, not those that were down already', () => {
    const actions: ButtonAction[] = [];
    let now = pad([0, 0, 0, 0], { down: [0] });
    const own = { ...DEFAULT_PAD, buttons: { 0: 'hold', 2: 'return' } as const };
    const source = padSource(
      now,
      () => [now],
      withPad(DEFAULT_SETTINGS, pad([0, 0, 0, 0]), own),
      (action) => actions.push(action),
    );
    const press = (...down: number[]): void => {
      now = pad([0, 0, 0, 0], { down });
      source.read(0);
    };
    press(0);
    expect(actions).toEqual([]);
    press();
    press(0, 1);
    press(0, 2);
    press(2);
    expect(actions).toEqual(['hold', 'none', 'return']);
  });
});
