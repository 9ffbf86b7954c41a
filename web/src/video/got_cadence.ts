/**
 * Decides when a viewer reports drawn pictures to the tower (`got`). While the stream is calm it reports only now and
 * then, which is a promise: it reports at once when a picture is late or missing. Otherwise it reports often, and the
 * tower bounds the data in flight by these reports (server/video/core/pacing.py). With many viewers of a stream, these
 * reports are a substantial part of their cost to the tower.
 *
 * The benchmarks' viewers do the same (bench/video/got_cadence.py).
 */

import type { Unit } from './unit';

/** While it is not calm: reports the first picture this long after the last report ... */
const EVERY_MS = 75;
/** ... and at the latest after this. */
const AT_LAST_MS = 120;
const CALM_EVERY_MS = 2_000;
/** Without any late or missing picture. */
const CALM_AFTER_MS = 500;
/** Compared with its best delay. */
const LATE_MS = 40;
/** After the due time of the next picture. */
const OVERDUE_MS = 50;
const BEST_FOR_MS = 30_000;

export type Done = Pick<Unit, 'sequence' | 'captureUs' | 'rateHz'>;

/**
 * `calm`: it will report at once when a picture is late or missing. `overdue`: the next picture should have arrived.
 * `held_ms`: time between drawing and this report.
 */
export interface Got {
  readonly sequence: number;
  readonly calm?: true;
  readonly overdue?: true;
  readonly held_ms?: number;
}

export class GotCadence {
  #saidAtMs = -Infinity;
  /** The last report said calm. */
  #promised = false;
  /** The last report said overdue. */
  #wasOverdue = false;
  #newest: number | null = null;
  #isUnsaid = false;
  #doneAtMs = 0;
  #uneasyAtMs: number | null = null;
  /** The next expected sequence number. */
  #next = 0;
  #expectedAtMs = Infinity;
  #bestMs = Infinity;
  #bestBeforeMs = Infinity;
  #bestSinceMs = -Infinity;

  /** A unit has arrived, and is about to be drawn. */
  came(sequence: number, nowMs: number): void {
    if (sequence !== this.#next) this.#uneasyAtMs = nowMs;
    this.#next = (sequence + 1) >>> 0;
  }

  /** This unit and all before it are done: returns the report to send now, if any. */
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

  /** When `look` is due, unless a unit is done before. It may be later then. */
  get lookAtMs(): number {
    if (this.#promised) return this.#expectedAtMs;
    return this.#isUnsaid ? this.#saidAtMs + AT_LAST_MS : Infinity;
  }

  /** Called at that time: returns the report to send, if any. */
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
