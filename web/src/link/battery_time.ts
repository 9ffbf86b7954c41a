/**
 * How long a battery lasts in flight: as the autopilot says, or else estimated from how its percentage has gone down
 * lately. On the ground there is no answer: what it draws there says nothing about flying. To empty; whoever flies
 * keeps a reserve.
 */

const WINDOW_MS = 240_000;
/** Percentages come in whole ones: fewer steps than this say more about the rounding than about the battery. */
const MIN_DROP = 3;
/** A climb after take-off costs twice what the flight does: not before that has passed for the most part. */
const MIN_SPAN_MS = 120_000;

export interface BatteryTime {
  readonly leftMs: number;
  readonly isEstimate: boolean;
}

interface Step {
  readonly atMs: number;
  readonly percent: number;
}

export class BatteryMeter {
  /** When each percentage was first seen in this flight, newest last. */
  #steps: Step[] = [];
  #isInAir = false;
  #saidMs: number | null = null;
  #saidAtMs = 0;

  /** Whether it flies; with each flight all begins again. */
  inAir(isInAir: boolean): void {
    if (isInAir === this.#isInAir) return;
    this.#isInAir = isInAir;
    this.#steps = [];
  }

  /** `percent` of SYS_STATUS, 0..100. */
  percentage(percent: number, atMs: number): void {
    if (!this.#isInAir) return;
    const last = this.#steps.at(-1);
    if (last?.percent === percent) return;
    // It does not fill in flight: this is another battery.
    if (last && percent > last.percent) this.#steps = [];
    this.#steps.push({ atMs, percent });
    while (this.#steps.length > MIN_DROP + 1 && atMs - this.#steps[0]!.atMs > WINDOW_MS) this.#steps.shift();
  }

  /** `seconds` of BATTERY_STATUS.time_remaining; 0 says nothing. */
  said(seconds: number, atMs: number): void {
    this.#saidMs = seconds > 0 ? seconds * 1000 : null;
    this.#saidAtMs = atMs;
  }

  /** Null on the ground, and for the first minutes of a flight whose autopilot does not say. */
  left(nowMs: number): BatteryTime | null {
    if (!this.#isInAir) return null;
    if (this.#saidMs !== null) {
      return { leftMs: Math.max(0, this.#saidMs - (nowMs - this.#saidAtMs)), isEstimate: false };
    }
    // The first one was there before we looked: the time at which it began is not known.
    const [, first] = this.#steps;
    const last = this.#steps.at(-1);
    if (!first || !last || first.percent - last.percent < MIN_DROP) return null;
    const spanMs = last.atMs - first.atMs;
    if (spanMs < MIN_SPAN_MS) return null;
    const perMs = (first.percent - last.percent) / spanMs;
    const leftMs = last.percent / perMs - (nowMs - last.atMs);
    // It goes down no more, or much slower: the estimate is over.
    return nowMs - last.atMs > 3 / perMs ? null : { leftMs: Math.max(0, leftMs), isEstimate: true };
  }
}
