/**
 * Learns a device step by step: where its sticks rest, which axis is which, their travel, and that they come back.
 * Tells sticks from what else an axis may be: triggers (some read 0 until they are touched), switches, hats, motion
 * sensors. Takes the device's readings one at a time; it knows neither the device nor a clock.
 */

import { SLOTS, type Slot } from './stick_modes';
import { MIN_TRAVEL, type PadSettings, type SlotSetting } from './stick_settings';

export type CalibrationStep =
  | { readonly name: 'rest' }
  | { readonly name: 'find'; readonly slot: Slot }
  | { readonly name: 'range' }
  | { readonly name: 'back' }
  | { readonly name: 'done' };

/** Why an axis is no stick, as far as it has been seen. */
export type NoStick =
  /** Rests at an end: a trigger, a switch, a hat, or a throttle that was not put in its middle. */
  | 'end'
  /** Goes from one place to another without the way between: a switch, a hat, or a stick moved too fast. */
  | 'jumps'
  /** Does not come back: a trigger, a switch, or a throttle that was left where it was. */
  | 'stays'
  /** Never rests: a motion sensor, or a stick that was moved at the beginning. */
  | 'restless';

/** How long the sticks must be still. */
const REST_MS = 700;
/** An axis that is not still by then never is. */
const RESTLESS_MS = 4_000;
/** An axis that is still away from its rest for so long does not come back by itself. */
const STAYS_MS = 2_000;
/** A jump is told once the axis is still again. */
const JUMPED_MS = 150;
/** How much a resting stick may vary. */
const STILL = 0.04;
/** A deflection that counts as deliberate. */
const MOVED = 0.5;
/** Back at rest, before the next stick. */
const BACK = 0.2;
/** No stick rests as far from the middle. */
const END = 0.5;
/** On its way a stick is seen at most places, `LEVEL` apart; a switch of six positions at a third of them. */
const LEVEL = 0.125;
const MIN_SHARE_SEEN = 0.5;
const MIN_LEVELS = 3;

interface Axis {
  value: number;
  stillAt: number;
  stillSinceMs: number;
  rest: number;
  wasStill: boolean;
  isRestless: boolean;
  stays: boolean;
  /** Places seen since it last was at rest. */
  levels: Set<number>;
  /** Seen while the sticks go round. */
  places: Set<number>;
  low: number;
  high: number;
}

interface Found {
  readonly axis: number;
  readonly isInverted: boolean;
}

export class PadCalibration {
  #step: CalibrationStep = { name: 'rest' };
  #axes: Axis[] = [];
  #begunMs = 0;
  #isBack = true;
  #centres: readonly number[] = [];
  #complaint: { readonly axis: number; readonly why: NoStick } | null = null;
  readonly #found = new Map<Slot, Found>();

  get step(): CalibrationStep {
    return this.#step;
  }

  /** Share of the current step, 0..1. */
  progress(nowMs: number): number {
    switch (this.#step.name) {
      case 'rest':
        return Math.min(1, ...this.#axes.map((axis) => (nowMs - axis.stillSinceMs) / REST_MS));
      case 'find':
        return this.#found.size / SLOTS.length;
      case 'range':
        return 1 - this.unfinished.length / SLOTS.length;
      case 'back':
      case 'done':
        return 1;
    }
  }

  /** Whether it waits for the sticks to be released first. */
  get waitsForRest(): boolean {
    return this.#step.name === 'find' && !this.#isBack;
  }

  /** The axis that was moved last and is no stick. */
  get complaint(): { readonly axis: number; readonly why: NoStick } | null {
    return this.#complaint;
  }

  /** What an axis is, as far as it is known. */
  roleOf(axis: number): Slot | NoStick | null {
    for (const [slot, found] of this.#found) if (found.axis === axis) return slot;
    const known = this.#axes[axis];
    return known && this.#step.name !== 'rest' ? noStick(known) : null;
  }

  take(values: readonly number[], nowMs: number): void {
    if (values.some((value) => !Number.isFinite(value))) return;
    if (values.length !== this.#axes.length) this.#beginAnew(values, nowMs);
    for (const [at, value] of values.entries()) see(this.#axes[at]!, value, nowMs);
    if (this.#step.name === 'rest') this.#rest(nowMs);
    else if (this.#step.name === 'find') this.#find(this.#step.slot, nowMs);
    else if (this.#step.name === 'range') this.#range();
    else if (this.#step.name === 'back') this.#back(nowMs);
  }

  /** Ends the last movement; returns false while a stick has not reached all its ends. */
  finish(): boolean {
    if (this.#step.name !== 'range' || this.unfinished.length > 0) return false;
    this.#step = { name: 'back' };
    return true;
  }

  /** What was learned, replacing the sticks in `before`; null before the end. */
  result(before: PadSettings): PadSettings | null {
    if (this.#step.name !== 'done') return null;
    const slot = (name: Slot): SlotSetting => {
      const { axis, isInverted } = this.#found.get(name)!;
      const { low, high } = this.#axes[axis]!;
      return { axis, isInverted, low, centre: this.#centres[axis]!, high };
    };
    const slots = { leftX: slot('leftX'), leftY: slot('leftY'), rightX: slot('rightX'), rightY: slot('rightY') };
    return { ...before, slots, isCalibrated: true };
  }

  /** At the beginning, and for a device that suddenly has another number of axes. */
  #beginAnew(values: readonly number[], nowMs: number): void {
    this.#step = { name: 'rest' };
    this.#found.clear();
    this.#complaint = null;
    this.#begunMs = nowMs;
    this.#isBack = true;
    this.#axes = values.map((value) => ({
      value,
      stillAt: value,
      stillSinceMs: nowMs,
      rest: value,
      wasStill: false,
      isRestless: false,
      stays: false,
      levels: new Set(),
      places: new Set(),
      low: value,
      high: value,
    }));
  }

  #rest(nowMs: number): void {
    const restless = this.#axes.filter((axis) => nowMs - axis.stillSinceMs < REST_MS);
    for (const axis of this.#axes) axis.wasStill ||= nowMs - axis.stillSinceMs >= REST_MS;
    const isEnough = nowMs - this.#begunMs >= RESTLESS_MS && restless.every((axis) => !axis.wasStill);
    if (restless.length > 0 && !isEnough) return;
    for (const axis of this.#axes) {
      axis.isRestless = restless.includes(axis);
      axis.rest = axis.low = axis.high = axis.value;
      axis.levels.clear();
    }
    this.#step = { name: 'find', slot: SLOTS[0]! };
  }

  #find(slot: Slot, nowMs: number): void {
    const taken = new Set([...this.#found.values()].map(({ axis }) => axis));
    for (const [at, axis] of this.#axes.entries()) if (!taken.has(at)) settle(axis, nowMs);
    if (!this.#isBack) return this.#release(nowMs);

    const away = [...this.#axes.entries()]
      .filter(([at, axis]) => !taken.has(at) && offRest(axis) >= MOVED)
      .sort(([, one], [, other]) => offRest(other) - offRest(one));
    const stick = away.find(([, axis]) => noStick(axis) === null && wasOnTheWay(axis));
    if (!stick) {
      // What was moved last: a switch may stay where it was put.
      away.sort(([, one], [, other]) => other.stillSinceMs - one.stillSinceMs);
      const other = away.find(([, axis]) => nowMs - axis.stillSinceMs >= JUMPED_MS || noStick(axis) !== null);
      if (other) this.#complaint = { axis: other[0], why: whyNot(other[1]) };
      return;
    }
    // Right and up are positive here, whatever they are on the device.
    this.#found.set(slot, { axis: stick[0], isInverted: stick[1].value < stick[1].rest });
    this.#complaint = null;
    this.#isBack = false;
  }

  /** A stick that was found must come back, and is none if it does not. */
  #release(nowMs: number): void {
    for (const [slot, { axis: at }] of this.#found) {
      const axis = this.#axes[at]!;
      if (offRest(axis) <= BACK || nowMs - axis.stillSinceMs < STAYS_MS) continue;
      this.#found.delete(slot);
      axis.stays = true;
      this.#complaint = { axis: at, why: whyNot(axis) };
    }
    this.#isBack = [...this.#found.values()].every(({ axis }) => offRest(this.#axes[axis]!) <= BACK);
    if (!this.#isBack) return;
    const next = SLOTS.find((slot) => !this.#found.has(slot));
    this.#step = next ? { name: 'find', slot: next } : { name: 'range' };
  }

  #range(): void {
    for (const axis of this.#axes) {
      axis.low = Math.min(axis.low, axis.value);
      axis.high = Math.max(axis.high, axis.value);
      axis.places.add(Math.round(axis.value / LEVEL));
    }
  }

  #back(nowMs: number): void {
    const sticks = [...this.#found.values()].map(({ axis }) => this.#axes[axis]!);
    if (!sticks.every((axis) => offRest(axis) <= BACK && nowMs - axis.stillSinceMs >= REST_MS)) return;
    // A worn stick comes back to either side of its middle.
    this.#centres = this.#axes.map((axis) => (axis.rest + axis.value) / 2);
    this.#step = { name: 'done' };
  }

  /** Sticks that have not been all the way to both sides. */
  get unfinished(): Slot[] {
    const enough = Math.max(MOVED, MIN_TRAVEL);
    return SLOTS.filter((name) => {
      const axis = this.#axes[this.#found.get(name)?.axis ?? -1];
      if (!axis || axis.high - axis.rest < enough || axis.rest - axis.low < enough) return true;
      return axis.places.size < (MIN_SHARE_SEEN * (axis.high - axis.low)) / LEVEL;
    });
  }
}

function see(axis: Axis, value: number, nowMs: number): void {
  axis.value = value;
  if (Math.abs(value - axis.stillAt) > STILL) {
    axis.stillAt = value;
    axis.stillSinceMs = nowMs;
  }
  if (offRest(axis) <= BACK) axis.levels.clear();
  else axis.levels.add(Math.round(value / LEVEL));
}

/** An axis that stays away is no stick, until it rests where it did at first. */
function settle(axis: Axis, nowMs: number): void {
  const stillMs = nowMs - axis.stillSinceMs;
  if (offRest(axis) > BACK) axis.stays ||= stillMs >= STAYS_MS;
  else if (stillMs >= REST_MS) axis.stays = false;
}

function whyNot(axis: Axis): NoStick {
  const why = noStick(axis) ?? 'jumps';
  // What stays and was not seen on its way has jumped there.
  if (axis.stays && why !== 'end' && why !== 'restless' && !wasOnTheWay(axis)) return 'jumps';
  return why;
}

/** Seen at most places between its rest and where it is. */
function wasOnTheWay({ value, rest, levels }: Axis): boolean {
  const seen = [...levels].filter((level) => level * LEVEL > rest === value > rest).length;
  return seen >= Math.max(MIN_LEVELS, (MIN_SHARE_SEEN * Math.abs(value - rest)) / LEVEL);
}

const offRest = (axis: Axis): number => Math.abs(axis.value - axis.rest);

function noStick(axis: Axis): NoStick | null {
  if (axis.isRestless) return 'restless';
  if (Math.abs(axis.rest) >= END) return 'end';
  if (axis.stays) return 'stays';
  return null;
}
