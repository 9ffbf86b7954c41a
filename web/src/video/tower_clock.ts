/**
 * The offset between the tower's clock and ours, from requests and responses: the fastest response is the most
 * accurate, because any extra delay is on one direction only. Uses a window, because the two clocks drift.
 */

const WINDOW_MS = 30_000;
const MAX_ANSWERS = 40;

interface Answer {
  readonly receivedMs: number;
  readonly roundTripMs: number;
  readonly offsetMs: number;
}

export class TowerClock {
  #answers: Answer[] = [];
  #best: Answer | null = null;

  /** A new connection may lead to another tower. */
  forget(): void {
    this.#answers = [];
    this.#best = null;
  }

  /** `sentMs`, `receivedMs`: our monotonic clock; `towerUs`: the tower's clock in between. */
  answered(sentMs: number, receivedMs: number, towerUs: number): void {
    const roundTripMs = receivedMs - sentMs;
    if (!(roundTripMs >= 0) || !Number.isFinite(towerUs)) return;
    const offsetMs = towerUs / 1000 - (sentMs + receivedMs) / 2;
    const oldest = receivedMs - WINDOW_MS;
    this.#answers = this.#answers.filter((one) => one.receivedMs >= oldest).slice(1 - MAX_ANSWERS);
    this.#answers.push({ receivedMs, roundTripMs, offsetMs });
    this.#best = this.#answers.reduce((best, one) => (one.roundTripMs <= best.roundTripMs ? one : best));
  }

  /** The age, at `nowMs` of our clock, of an event at `atUs` of the tower's; null before the first response. */
  ageMs(atUs: number, nowMs: number): number | null {
    return this.#best && nowMs + this.#best.offsetMs - atUs / 1000;
  }

  get roundTripMs(): number | null {
    return this.#best && this.#best.roundTripMs;
  }
}
