/**
 * When the map fits the squad automatically: as drones get their first positions one by one, for a while after the
 * first, and when a first position proves wrong; never again once the user has moved the map. Independent of any map:
 * the caller passes `fit`.
 */

import { distanceM } from '../link/geometry';
import type { Place } from '../link/messages';

/** Drones switched on together get positions together; a later one must not move the map. */
export const GATHERING_MS = 120_000;

/** A position that jumps this far between two ticks, faster than anything flies, was wrong before. */
const LEAP_M = 2_000;
const LEAP_MPS = 350;

export interface Located {
  readonly id: number;
  readonly place: Place;
}

export class AutoFit {
  /** Where each drone was at the last tick that showed all. */
  readonly #seen = new Map<number, { readonly place: Place; readonly atMs: number }>();
  #firstMs: number | null = null;
  #isOver = false;

  /** The user moved the map: automatic fitting ends. */
  moved(): void {
    this.#isOver = true;
  }

  /**
   * Called at each tick with the drones that have a position. `fit` shows all these places and returns whether it could
   * (a map without a size cannot): until it can, it is called again.
   */
  consider(drones: readonly Located[], nowMs: number, fit: (places: readonly Place[]) => boolean): void {
    if (this.#isOver || drones.length === 0) return;
    if (this.#firstMs !== null && nowMs - this.#firstMs > GATHERING_MS) {
      this.#isOver = true;
      return;
    }
    const isAsBefore = drones.every((drone) => this.#isKnown(drone, nowMs));
    if (!isAsBefore && !fit(drones.map(({ place }) => place))) return;
    this.#firstMs ??= nowMs;
    for (const { id, place } of drones) this.#seen.set(id, { place, atMs: nowMs });
  }

  #isKnown({ id, place }: Located, nowMs: number): boolean {
    const before = this.#seen.get(id);
    if (!before) return false;
    return distanceM(before.place, place) < Math.max(LEAP_M, (LEAP_MPS * (nowMs - before.atMs)) / 1000);
  }
}
