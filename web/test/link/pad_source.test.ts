import { describe, expect, it } from 'vitest';

import { padAxes, padSource, usablePads, type PadLike } from '../../src/link/pad_source';
import { DEFAULT_PAD, DEFAULT_SETTINGS, withPad, type ButtonAction } from '../../src/link/stick_settings';
import { CENTRED } from '../../src/link/sticks';
import { pad } from './pads';

describe('a pad that nobody has set up', () => {
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
      slots: { ...DEFAULT_PAD.slots, leftY: { axis: 5, isInverted: false, low: -0.5, centre: 0, high: 0.5 } },
      shapes: { ...DEFAULT_PAD.shapes, throttle: { deadZone: 0, expo: 0 }, pitch: { deadZone: 0, expo: 1 } },
    };
    const settings = withPad({ ...DEFAULT_SETTINGS, mode: 2 }, 'P', own);
    expect(padAxes(pad([0, 1, 0, -0.5, 0, 0.25]), settings)).toEqual({ ...CENTRED, throttle: 0.5, pitch: 0.125 });
    expect(padAxes(pad([0, 1, 0, -0.5]), settings)).toBeNull(); // it no longer has that axis
    const mode1 = padAxes(pad([0, 1, 0, -0.5, 0, 0.25]), { ...settings, mode: 1 })!;
    expect(mode1.pitch).toBeCloseTo(0.125);
    expect(mode1.throttle).toBeCloseTo(0.5);
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
      withPad(DEFAULT_SETTINGS, 'P', own),
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
