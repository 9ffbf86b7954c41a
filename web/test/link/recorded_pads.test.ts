/** Twelve devices: none flies before it is set up, each can be set up in a minute, and their sticks are read rightly. */

import { describe, expect, it } from 'vitest';

import { PadCalibration } from '../../src/link/pad_calibration';
import { padAxes, padSource, padSticks, unready } from '../../src/link/pad_source';
import { SLOTS, type Slot } from '../../src/link/stick_modes';
import {
  DEFAULT_SETTINGS,
  padSettingsOf,
  readDocument,
  toDocument,
  withPad,
  type StickSettings,
} from '../../src/link/stick_settings';
import { CENTRED } from '../../src/link/sticks';
import { SticksSeen } from '../../src/link/sticks_seen';
import { DEVICES, Hands, type Device } from './recorded_pads';

const MINUTE_MS = 60_000;

/** Follows the words on the screen. Before each stick something else is used by mistake. */
function setUp(device: Device): { readonly settings: StickSettings; readonly hands: Hands } {
  const calibration = new PadCalibration();
  const hands = new Hands(device, (pad, nowMs) => calibration.take(pad.axes, nowMs));
  const mistakes = Object.keys(device.others).map(Number);
  while (calibration.step.name !== 'done') {
    const { step, waitsForRest } = calibration;
    if (hands.nowMs > MINUTE_MS) throw new Error(`not set up in a minute: ${step.name}`);
    if (step.name === 'find' && !waitsForRest) {
      const mistake = mistakes.shift();
      if (mistake !== undefined) {
        hands.use(mistake);
        hands.wait(2_200);
        continue;
      }
      hands.move(step.slot, 1);
      hands.move(step.slot, 0);
    } else if (step.name === 'range') {
      for (const slot of SLOTS) for (const share of [1, -1, 0]) hands.move(slot, share);
      expect(calibration.unfinished).toEqual([]);
      expect(calibration.finish()).toBe(true);
    }
    hands.wait(100);
  }
  const before = padSettingsOf(DEFAULT_SETTINGS, hands.pad);
  return { settings: withPad(DEFAULT_SETTINGS, hands.pad, calibration.result(before)!), hands };
}

describe.each(DEVICES.map((device) => [device.id, device] as const))('%s', (_, device) => {
  it('flies only with the standard layout, or once it is set up', () => {
    const { pad } = new Hands(device);
    const isStandard = device.mapping === 'standard';
    expect(unready(pad, DEFAULT_SETTINGS)).toBe(isStandard ? null : 'unknown-layout');
    expect(padAxes(pad, DEFAULT_SETTINGS)).toEqual(isStandard ? CENTRED : null);
    expect(padSource(pad, () => [pad], DEFAULT_SETTINGS).read(0)).toEqual(isStandard ? CENTRED : null);
  });

  it('is set up in a minute, whatever else is touched, and its sticks are those that were moved', () => {
    const { settings, hands } = setUp(device);
    expect(hands.nowMs).toBeLessThan(MINUTE_MS);
    const stored = readDocument(JSON.parse(JSON.stringify(toDocument(settings))));
    const { slots } = padSettingsOf(stored, hands.pad);
    for (const slot of SLOTS) expect(slots[slot].axis).toBe(device.sticks[slot].axis);
    expect(unready(hands.pad, stored)).toBeNull();
    expect(padAxes(hands.pad, stored)).toEqual(CENTRED);

    for (const slot of SLOTS) {
      for (const share of [1, 0.5, -0.5, -1]) {
        hands.move(slot, share);
        const sticks = padSticks(hands.pad, padSettingsOf(stored, hands.pad))!;
        for (const one of SLOTS) expect(sticks[one]).toBeCloseTo(one === slot ? share : 0, 1);
      }
      hands.move(slot, 0);
    }
  });

  it('flies once each stick has been seen to move', () => {
    const { settings, hands } = setUp(device);
    const seen = new SticksSeen();
    const look = (): Slot[] => {
      seen.take(hands.pad, settings);
      return seen.unmoved;
    };
    const left = [...SLOTS];
    expect(look()).toEqual(left);
    for (const slot of SLOTS) {
      hands.move(slot, slot === 'leftY' ? -0.8 : 0.8);
      left.shift();
      expect(look()).toEqual(left);
      hands.move(slot, 0);
    }
    const own = padSettingsOf(settings, hands.pad);
    seen.take(hands.pad, withPad(settings, hands.pad, { ...own, buttons: { 1: 'hold' } }));
    expect(seen.unmoved).toEqual([]);
    seen.take(hands.pad, withPad(settings, hands.pad, { ...own, slots: { ...own.slots } }));
    expect(seen.unmoved).toEqual(SLOTS);
    for (const slot of SLOTS) {
      hands.move(slot, 1);
      look();
      hands.move(slot, 0);
    }
    expect(look()).toEqual([]);
    seen.forget();
    expect(look()).toEqual(SLOTS);
  });

  it('with other axes is another device', () => {
    const { settings, hands } = setUp(device);
    const more = { ...hands.pad, mapping: '', axes: [...hands.pad.axes, 0] };
    expect(unready(more, settings)).toBe('other-layout');
    expect(padAxes(more, settings)).toBeNull();
    let now = hands.pad;
    const source = padSource(now, () => [now], settings);
    expect(source.read(0)).toEqual(CENTRED);
    now = more;
    expect(source.read(1)).toBeNull();
    now = hands.pad;
    expect(source.read(2)).toBeNull();
  });
});
