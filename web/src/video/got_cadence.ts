/**
 * When a viewer tells the tower what it has drawn (`got`). While all is well it does so now and then, and that is a
 * promise: it speaks up as soon as something is late or does not come. What it then says often is what the tower bounds
 * by what is on its way (server/live/video/pacing.py). For many viewers of a stream, answers are a good part of what they
 * cost the tower.
 *
 * The benchmarks' viewers do the same (bench/video/got_cadence.py).
 */

import type { Unit } from './unit';

/** While it is not calm: for the first picture so long after it last said something ... */
const EVERY_MS = 75;
/** ... and then at the latest. */
const AT_LAST_MS = 120;
const CALM_EVERY_MS = 2_000;
/** Without anything late or missing. */
const CALM_AFTER_MS = 500;
/** Later than at its best. */
const LATE_MS = 40;
/** After the time at which the next picture should have come. */
const OVERDUE_MS = 50;
const BEST_FOR_MS = 30_000;

export type Done = Pick<Unit, 'sequence' | 'captureUs' | 'rateHz'>;

/**
 * `calm`: it will say at once when something is late or missing. `overdue`: the next one should have come. `held_ms`: it
 * was drawn so long before this is said.
 */
export interface Got {
  readonly sequence: number;
  readonly calm?: true;
  readonly overdue?: true;
  readonly held_ms?: number;
}

export class GotCadence {
  #saidAtMs = -Infinity;
  /** It last said that it is calm. */
  #promised = false;
  /** It last said that something should have come. */
  #wasOverdue = false;
  #newest: number | null = null;
  #isUnsaid = false;
  #doneAtMs = 0;
  #uneasyAtMs: number | null = null;
  /** The sequence that comes next. */
  #next = 0;
  #expectedAtMs = Infinity;
  #bestMs = Infinity;
  #bestBeforeMs = Infinity;
  #bestSinceMs = -Infinity;

  /** A unit has come, and is about to be drawn. */
  came(sequence: number, nowMs: number): void {
    if (sequence !== this.#next) this.#uneasyAtMs = nowMs;
    this.#next = (sequence + 1) >>> 0;
  }

  /** This one is done with, and all before it: what is to be said of it now, if anything. */
  done({ sequence, captureUs, rateHz }: Done, nowMs: number): Got | null {
    if (this.#uneasyAtMs === null || captureUs === null || this.#isLate(nowMs - captureUs / 1000, nowMs)) {
      this.#uneasyAtMs = nowMs;
    }
    this.#newest = sequence;
    this.#isUnsaid = true;
    this.#doneAtMs = nowMs;
    this.#expectedAtMs = nowMs + 1000 / rateHz + OVERDUE_MS;
    const isCalm = nowMs - this.#uneasyAtMs >= CALM_AFTER_MS;
    const speaksUp = this.#wasOverdue || (this.#promised && !isCalm);
    const everyMs = this.#promised ? CALM_EVERY_MS : EVERY_MS;
    if (!speaksUp && nowMs - this.#saidAtMs < everyMs) return null;
    return this.#say(isCalm ? { sequence, calm: true } : { sequence }, nowMs);
  }

  /** When `look` has something to say, if nothing is done with before. It may be later, then. */
  get lookAtMs(): number {
    if (this.#promised) return this.#expectedAtMs;
    return this.#isUnsaid ? this.#saidAtMs + AT_LAST_MS : Infinity;
  }

  /** The time has come: what is to be said, if anything. */
  look(nowMs: number): Got | null {
    const sequence = this.#newest;
    if (sequence === null || nowMs < this.lookAtMs) return null;
    const held_ms = Math.round(nowMs - this.#doneAtMs);
    if (!this.#promised) return this.#say({ sequence, held_ms }, nowMs);
    this.#uneasyAtMs = nowMs;
    return this.#say({ sequence, overdue: true, held_ms }, nowMs);
  }

  #say(got: Got, nowMs: number): Got {
    this.#saidAtMs = nowMs;
    this.#isUnsaid = false;
    this.#promised = got.calm === true;
    this.#wasOverdue = got.overdue === true;
    return got;
  }

  #isLate(tookMs: number, nowMs: number): boolean {
    if (nowMs - this.#bestSinceMs > BEST_FOR_MS) {
      this.#bestBeforeMs = this.#bestMs;
      this.#bestMs = tookMs;
      this.#bestSinceMs = nowMs;
    } else if (tookMs < this.#bestMs) {
      this.#bestMs = tookMs;
    }
    return tookMs - Math.min(this.#bestMs, this.#bestBeforeMs) > LATE_MS;
  }
}
