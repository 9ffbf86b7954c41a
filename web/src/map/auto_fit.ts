/**
 * When the map goes to the squad by itself: as drones get their first positions, one after the other, for a while
 * after the first, and when one's first position turns out to have been wrong; never again once the user has moved the
 * map. Knows nothing of any map: `fit` is one's own.
 */

import { distanceM } from '../link/geometry';
import type { Place } from '../link/messages';

/** A squad that is switched on together has its positions together; one that comes later must not move the map. */
export const GATHERING_MS = 120_000;

/** Whatever is this much further off than at the last beat, and was quicker there than anything flies, was not there. */
const LEAP_M = 2_000;
const LEAP_MPS = 350;

export interface Located {
  readonly id: number;
  readonly place: Place;
}

export class AutoFit {
  /** Where each was at the last beat at which all were shown. */
  readonly #seen = new Map<number, { readonly place: Place; readonly atMs: number }>();
  #firstMs: number | null = null;
  #isOver = false;

  /** The user moved the map: from now on it is theirs. */
  moved(): void {
    this.#isOver = true;
  }

  /**
   * Give it the drones that have a position, at each beat. `fit` shows all these places and says whether it could
   * (a map that has no size yet cannot): until it could, it is asked again.
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
