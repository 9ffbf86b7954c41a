/**
 * When the map goes to the squad by itself: as drones get their first positions, one after the other, for a while
 * after the first; never again once the user has moved the map. Knows nothing of any map: `fit` is one's own.
 */

import type { Place } from '../link/messages';

/** A squad that is switched on together has its positions together; one that comes later must not move the map. */
export const GATHERING_MS = 120_000;

export interface Located {
  readonly id: number;
  readonly place: Place;
}

export class AutoFit {
  readonly #shown = new Set<number>();
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
    if (drones.every(({ id }) => this.#shown.has(id))) return;
    if (!fit(drones.map(({ place }) => place))) return;
    this.#firstMs ??= nowMs;
    for (const { id } of drones) this.#shown.add(id);
  }
}
