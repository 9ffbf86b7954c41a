/**
 * How the tower's clock stands to ours, from questions and answers: the answer that came back fastest says it best, as
 * whatever delayed the others did so on one way only. A window, as the two clocks do not run equally fast.
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

  /** Of another connection, that perhaps leads to another tower. */
  forget(): void {
    this.#answers = [];
    this.#best = null;
  }

  /** `sentMs`, `receivedMs`: by our monotonic clock; `towerUs`: what the tower's said in between. */
  answered(sentMs: number, receivedMs: number, towerUs: number): void {
    const roundTripMs = receivedMs - sentMs;
    if (!(roundTripMs >= 0) || !Number.isFinite(towerUs)) return;
    const offsetMs = towerUs / 1000 - (sentMs + receivedMs) / 2;
    const oldest = receivedMs - WINDOW_MS;
    this.#answers = this.#answers.filter((one) => one.receivedMs >= oldest).slice(1 - MAX_ANSWERS);
    this.#answers.push({ receivedMs, roundTripMs, offsetMs });
    this.#best = this.#answers.reduce((best, one) => (one.roundTripMs <= best.roundTripMs ? one : best));
  }

  /** How old at `nowMs` of our clock is what happened at `atUs` of the tower's; null before the first answer. */
  ageMs(atUs: number, nowMs: number): number | null {
    return this.#best && nowMs + this.#best.offsetMs - atUs / 1000;
  }

  get roundTripMs(): number | null {
    return this.#best && this.#best.roundTripMs;
  }
}
