/**
 * Input devices as browsers report them, and hands that move them. Axes are numbered as the named browser and system
 * number them; a control that is not touched reads what the browser says before its first event.
 */

import type { PadLike } from '../../src/link/pad_source';
import type { Slot } from '../../src/link/stick_modes';

export interface StickAxis {
  readonly axis: number;
  /** What the axis reads with the stick right or up, let go, and left or down. */
  readonly ends: readonly [high: number, rest: number, low: number];
}

/** Anything else: the places it takes when it is used once, the last of which it keeps. */
export interface OtherAxis {
  /** Read until it is used: browsers say 0 for an axis that has not changed. */
  readonly before: number;
  readonly used: readonly number[];
  /** Whether the way from place to place is reported, as for a trigger or a knob. */
  readonly slides: boolean;
}

export interface Device {
  readonly id: string;
  readonly mapping: '' | 'standard';
  readonly sticks: Readonly<Record<Slot, StickAxis>>;
  readonly others: Readonly<Record<number, OtherAxis>>;
  readonly buttons: number;
  /** Axes of motion sensors, which no hand can hold still. */
  readonly restless?: readonly number[];
}

const axis = (number: number, high: number, rest = 0, low = -high): StickAxis => ({
  axis: number,
  ends: [high, rest, low],
});
const sticks = (leftX: StickAxis, leftY: StickAxis, rightX: StickAxis, rightY: StickAxis): Device['sticks'] => ({
  leftX,
  leftY,
  rightX,
  rightY,
});
/** Reads 0 until it is touched, and then -1 to 1. */
const TRIGGER: OtherAxis = { before: 0, used: [1, -1], slides: true };
const AWAKE_TRIGGER: OtherAxis = { before: -1, used: [1, -1], slides: true };
const HAT: OtherAxis = { before: 0, used: [1, 0, -1, 0], slides: false };
/** Eight directions on one axis, and a rest beyond its end. */
const HAT_ON_ONE_AXIS: OtherAxis = { before: 1.2857, used: [-1, -0.714, 0.143, 1.2857], slides: false };
const SWITCH_2: OtherAxis = { before: -1, used: [1], slides: false };
const SWITCH_3: OtherAxis = { before: 0, used: [1, -1], slides: false };
const SWITCH_6: OtherAxis = { before: 0.2, used: [0.6, 1, -0.2, -0.6, -1, 0.2], slides: false };
const KNOB: OtherAxis = { before: 0, used: [0.8], slides: true };
const LEVER: OtherAxis = { before: 1, used: [0.2], slides: true };

const UP_IS_MINUS = sticks(axis(0, 1), axis(1, -1), axis(2, 1), axis(3, -1));

export const DEVICES: readonly Device[] = [
  {
    id: 'Xbox 360 Controller (XInput STANDARD GAMEPAD)', // Chrome, Windows
    mapping: 'standard',
    sticks: UP_IS_MINUS,
    others: {},
    buttons: 17,
  },
  {
    id: '054c-09cc-Wireless Controller', // Firefox, Windows: rests a little off its middle
    mapping: 'standard',
    sticks: sticks(axis(0, 1, 0.004), axis(1, -1, 0.02), axis(2, 1, -0.03), axis(3, -1, 0.01)),
    others: {},
    buttons: 18,
  },
  {
    id: '045e-028e-Microsoft X-Box 360 pad', // Firefox, Linux: axis 2 is the left trigger
    mapping: '',
    sticks: sticks(axis(0, 1), axis(1, -1), axis(3, 1), axis(4, -1)),
    others: { 2: TRIGGER, 5: TRIGGER, 6: HAT, 7: HAT },
    buttons: 11,
  },
  {
    id: '054c-09cc-Sony Interactive Entertainment Wireless Controller', // Firefox, Linux
    mapping: '',
    sticks: sticks(axis(0, 1, 0.02), axis(1, -1, -0.04), axis(3, 1, 0.03), axis(4, -1)),
    others: { 2: TRIGGER, 5: TRIGGER, 6: HAT, 7: HAT },
    buttons: 13,
  },
  {
    id: '045e-0b13-Xbox Wireless Controller', // Firefox, Linux, Bluetooth: gas and brake
    mapping: '',
    sticks: sticks(axis(0, 1), axis(1, -1), axis(2, 1), axis(3, -1)),
    others: { 4: AWAKE_TRIGGER, 5: AWAKE_TRIGGER, 6: HAT, 7: HAT },
    buttons: 16,
  },
  {
    id: 'FrSky Taranis Joystick (Vendor: 0483 Product: 5710)', // a radio: A E T R, switches after them
    mapping: '',
    sticks: sticks(axis(3, 1), axis(2, 1), axis(0, 1), axis(1, 1)),
    others: { 4: SWITCH_2, 5: SWITCH_3, 6: KNOB, 7: SWITCH_3 },
    buttons: 24,
  },
  {
    id: '1209-4f54-OpenTX RadioMaster TX16S Joystick', // trims move the middles, travel of 90 %
    mapping: '',
    sticks: sticks(
      axis(3, 0.9, 0.05, -0.9),
      axis(2, 0.9, 0, -0.9),
      axis(0, 0.9, -0.06, -0.9),
      axis(1, 0.9, 0.08, -0.9),
    ),
    others: { 4: SWITCH_6, 5: KNOB, 6: LEVER, 7: SWITCH_2 },
    buttons: 24,
  },
  {
    id: 'SPEKTRUM RECEIVER (Vendor: 0483 Product: 572b)', // throttle first, rudder reversed
    mapping: '',
    sticks: sticks(axis(3, -0.85), axis(0, 0.85), axis(1, 0.85), axis(2, 0.85)),
    others: { 4: SWITCH_2, 5: SWITCH_2 },
    buttons: 0,
  },
  {
    id: 'FeiYing Model PPM TO USB (Vendor: 0451 Product: 16a5)', // half the travel, one half shorter than the other
    mapping: '',
    sticks: sticks(axis(0, 0.7, 0.1, -0.55), axis(1, 0.62, 0, -0.6), axis(2, 0.6), axis(5, -0.6, -0.05, 0.7)),
    others: { 3: SWITCH_2, 4: KNOB },
    buttons: 0,
  },
  {
    id: '046d-c215-Logitech Logitech Extreme 3D', // Firefox, Linux: a throttle lever that stays, a hat on two axes
    mapping: '',
    sticks: sticks(axis(2, 1), axis(3, -1), axis(0, 1), axis(1, -1)),
    others: { 4: HAT, 5: HAT },
    buttons: 12,
  },
  {
    id: 'T.16000M (Vendor: 044f Product: b10a)', // Chrome: a hat on axis 9, axes between that nothing moves
    mapping: '',
    sticks: sticks(axis(5, 1), axis(6, -1), axis(0, 1), axis(1, -1)),
    others: { 2: LEVER, 9: HAT_ON_ONE_AXIS },
    buttons: 16,
  },
  {
    id: '054c-0268-Sony PLAYSTATION(R)3 Controller', // motion sensors among the axes
    mapping: '',
    sticks: sticks(axis(0, 1), axis(1, -1), axis(2, 1), axis(3, -1)),
    others: { 8: TRIGGER, 9: TRIGGER },
    buttons: 19,
    restless: [4, 5, 6],
  },
];

/** Somebody's hands on a device, a reading every 20 ms. */
export class Hands {
  readonly #device: Device;
  readonly #onReading: (pad: PadLike, nowMs: number) => void;
  readonly values: number[];
  nowMs = 0;

  constructor(device: Device, onReading: (pad: PadLike, nowMs: number) => void = () => undefined) {
    this.#device = device;
    this.#onReading = onReading;
    const numbers = [
      ...Object.values(device.sticks).map((one) => one.axis),
      ...Object.keys(device.others).map(Number),
      ...(device.restless ?? []),
    ];
    this.values = Array<number>(Math.max(...numbers) + 1).fill(0);
    for (const { axis: at, ends } of Object.values(device.sticks)) this.values[at] = ends[1];
    for (const [at, { before }] of Object.entries(device.others)) this.values[Number(at)] = before;
  }

  get pad(): PadLike {
    const { id, mapping, buttons } = this.#device;
    return {
      id,
      mapping,
      index: 0,
      connected: true,
      axes: [...this.values],
      buttons: Array.from({ length: buttons }, () => ({ pressed: false })),
    };
  }

  wait(ms: number): void {
    for (const endMs = this.nowMs + ms; this.nowMs < endMs; this.nowMs += 20) {
      for (const at of this.#device.restless ?? []) this.values[at] = 0.4 * Math.sin(this.nowMs / 90 + at);
      this.#onReading(this.pad, this.nowMs);
    }
  }

  /** In a third of a second. */
  slide(to: Readonly<Record<number, number>>): void {
    const from = [...this.values];
    for (let step = 1; step <= 16; step++) {
      for (const [at, value] of Object.entries(to)) {
        this.values[Number(at)] = from[Number(at)]! + ((value - from[Number(at)]!) * step) / 16;
      }
      this.wait(20);
    }
  }

  /** To a share of its travel, right and up positive. */
  move(slot: Slot, share: number): void {
    this.slide({ [this.#device.sticks[slot].axis]: this.reading(slot, share) });
  }

  reading(slot: Slot, share: number): number {
    const [high, rest, low] = this.#device.sticks[slot].ends;
    return rest + (share >= 0 ? (high - rest) * share : (rest - low) * share);
  }

  /** A trigger pressed and let go, a switch or a knob turned, a hat pushed. */
  use(at: number): void {
    const { used, slides } = this.#device.others[at]!;
    for (const place of used) {
      if (slides) this.slide({ [at]: place });
      else this.values[at] = place;
      this.wait(100);
    }
  }
}
