/**
 * How long a battery lasts in flight: as the autopilot reports, or else estimated from the recent fall of its
 * percentage. No value on the ground: consumption there says nothing about flight. The time is until empty; a pilot
 * keeps a reserve.
 */

const WINDOW_MS = 240_000;
/** Percentages are whole numbers: with fewer steps than this, rounding dominates. */
const MIN_DROP = 3;
/** A climb after take-off draws twice as much as cruise: wait until most of it has passed. */
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
  /** MAV_BATTERY_CHARGE_STATE by battery. */
  readonly #charges = new Map<number, number>();

  /** Whether the drone flies; each flight starts from scratch. */
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
    // Batteries do not charge in flight: this is another battery.
    if (last && percent > last.percent) this.#steps = [];
    this.#steps.push({ atMs, percent });
    while (this.#steps.length > MIN_DROP + 1 && atMs - this.#steps[0]!.atMs > WINDOW_MS) this.#steps.shift();
  }

  /** `seconds` of BATTERY_STATUS.time_remaining; 0 means unknown. */
  said(seconds: number, atMs: number): void {
    this.#saidMs = seconds > 0 ? seconds * 1000 : null;
    this.#saidAtMs = atMs;
  }

  charge(battery: number, state: number): void {
    this.#charges.set(battery, state);
  }

  /** The worst of all batteries; null: never reported. */
  get worstCharge(): number | null {
    // 7 is "charging", which is no trouble.
    const states = [...this.#charges.values()].map((state) => (state > 6 ? 1 : state));
    return states.length === 0 ? null : Math.max(...states);
  }

  /** Null on the ground, and for the first minutes of a flight if the autopilot does not report the time. */
  left(nowMs: number): BatteryTime | null {
    if (!this.#isInAir) return null;
    if (this.#saidMs !== null) {
      return { leftMs: Math.max(0, this.#saidMs - (nowMs - this.#saidAtMs)), isEstimate: false };
    }
    // The first percentage began before the measurement: its start time is unknown.
    const [, first] = this.#steps;
    const last = this.#steps.at(-1);
    if (!first || !last || first.percent - last.percent < MIN_DROP) return null;
    const spanMs = last.atMs - first.atMs;
    if (spanMs < MIN_SPAN_MS) return null;
    const perMs = (first.percent - last.percent) / spanMs;
    const leftMs = last.percent / perMs - (nowMs - last.atMs);
    // The percentage stopped falling, or falls much slower: the estimate no longer holds.
    return nowMs - last.atMs > 3 / perMs ? null : { leftMs: Math.max(0, leftMs), isEstimate: true };
  }
}
