/**
 * Learns a pad step by step: where its sticks rest, which axis is which stick, and their travel. Takes the pad's
 * readings one at a time; it knows neither the pad nor a clock.
 */

import { SLOTS, type Slot } from './stick_modes';
import { MIN_TRAVEL, type PadSettings, type SlotSetting } from './stick_settings';

export type CalibrationStep =
  | { readonly name: 'rest' }
  | { readonly name: 'find'; readonly slot: Slot }
  | { readonly name: 'range' }
  | { readonly name: 'done' };

/** Number of readings (at 50 or 60 a second) for which the sticks must be still. */
const REST_BEATS = 40;
/** How much a resting stick may vary. */
const STILL = 0.04;
/** A deflection that counts as deliberate. */
const MOVED = 0.5;
/** Back at rest, before the next stick. */
const BACK = 0.2;

interface Seen {
  low: number;
  high: number;
}

export class PadCalibration {
  #step: CalibrationStep = { name: 'rest' };
  #still = 0;
  #last: readonly number[] = [];
  #centre: readonly number[] = [];
  #isBack = true;
  #travels: Seen[] = [];
  readonly #found = new Map<Slot, { readonly axis: number; readonly isInverted: boolean }>();

  get step(): CalibrationStep {
    return this.#step;
  }

  /** Share of the current step, 0..1. */
  get progress(): number {
    switch (this.#step.name) {
      case 'rest':
        return Math.min(1, this.#still / REST_BEATS);
      case 'find':
        return this.#found.size / SLOTS.length;
      case 'range':
        return this.#unfinished().length === 0 ? 1 : 1 - this.#unfinished().length / SLOTS.length;
      case 'done':
        return 1;
    }
  }

  /** Whether it waits for the sticks to be released first. */
  get waitsForRest(): boolean {
    return this.#step.name === 'find' && !this.#isBack;
  }

  take(axes: readonly number[]): void {
    if (axes.some((value) => !Number.isFinite(value))) return;
    if (this.#step.name === 'rest') this.#rest(axes);
    else if (this.#step.name === 'find') this.#find(this.#step.slot, axes);
    else if (this.#step.name === 'range') this.#range(axes);
    this.#last = axes;
  }

  /** Ends the last step; returns false while a stick has not reached all its ends. */
  finish(): boolean {
    if (this.#step.name !== 'range' || this.#unfinished().length > 0) return false;
    this.#step = { name: 'done' };
    return true;
  }

  /** What was learned, replacing the sticks in `before`; null before the end. */
  result(before: PadSettings): PadSettings | null {
    if (this.#step.name !== 'done') return null;
    const slot = (name: Slot): SlotSetting => {
      const { axis, isInverted } = this.#found.get(name)!;
      const { low, high } = this.#travels[axis]!;
      const centre = this.#centre[axis]!;
      return { axis, isInverted, low, centre, high };
    };
    const slots = { leftX: slot('leftX'), leftY: slot('leftY'), rightX: slot('rightX'), rightY: slot('rightY') };
    return { ...before, slots, isCalibrated: true };
  }

  #rest(axes: readonly number[]): void {
    const isStill = axes.length === this.#last.length && axes.every((value, at) => near(value, this.#last[at]!, STILL));
    this.#still = isStill ? this.#still + 1 : 0;
    if (this.#still < REST_BEATS) return;
    this.#centre = axes;
    this.#travels = axes.map((value) => ({ low: value, high: value }));
    this.#step = { name: 'find', slot: SLOTS[0]! };
  }

  #find(slot: Slot, axes: readonly number[]): void {
    const taken = new Set([...this.#found.values()].map(({ axis }) => axis));
    if (!this.#isBack) {
      this.#isBack = axes.every((value, at) => near(value, this.#centre[at]!, BACK));
      return;
    }
    const away = axes.map((value, at) => (taken.has(at) ? 0 : value - this.#centre[at]!));
    const axis = away.reduce((best, value, at) => (Math.abs(value) > Math.abs(away[best]!) ? at : best), 0);
    if (Math.abs(away[axis] ?? 0) < MOVED) return;
    // Right and up are positive here, whatever they are on the pad.
    this.#found.set(slot, { axis, isInverted: away[axis]! < 0 });
    this.#isBack = false;
    const next = SLOTS[SLOTS.indexOf(slot) + 1];
    this.#step = next ? { name: 'find', slot: next } : { name: 'range' };
  }

  #range(axes: readonly number[]): void {
    for (const [at, value] of axes.entries()) {
      const seen = this.#travels[at];
      if (!seen) continue;
      seen.low = Math.min(seen.low, value);
      seen.high = Math.max(seen.high, value);
    }
  }

  /** Sticks that have not been moved far enough to both sides. */
  #unfinished(): Slot[] {
    return SLOTS.filter((name) => {
      const { axis } = this.#found.get(name) ?? { axis: -1 };
      const [seen, centre] = [this.#travels[axis], this.#centre[axis]];
      if (!seen || centre === undefined) return true;
      return seen.high - centre < Math.max(MOVED, MIN_TRAVEL) || centre - seen.low < Math.max(MOVED, MIN_TRAVEL);
    });
  }
}

const near = (value: number, other: number, limit: number): boolean => Math.abs(value - other) <= limit;
