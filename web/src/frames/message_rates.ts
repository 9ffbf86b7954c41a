/** How often each kind of message comes, from counts that are taken now and then. */

import type { FrameKind } from './frame_log';

export const RATE_OVER_MS = 5_000;

interface Counted {
  readonly atMs: number;
  readonly counts: readonly number[];
}

export class MessageRates {
  #taken: Counted[] = [];

  take(kinds: readonly FrameKind[], nowMs: number): void {
    this.#taken.push({ atMs: nowMs, counts: kinds.map(({ count }) => count) });
    while (this.#taken.length > 2 && this.#taken[1]!.atMs <= nowMs - RATE_OVER_MS) this.#taken.shift();
  }

  /** Messages a second of this kind over the last seconds; null before there were two counts. */
  perSecond(kind: number): number | null {
    const first = this.#taken[0];
    const last = this.#taken.at(-1);
    if (!first || !last || last.atMs <= first.atMs) return null;
    return ((last.counts[kind] ?? 0) - (first.counts[kind] ?? 0)) / ((last.atMs - first.atMs) / 1000);
  }
}
