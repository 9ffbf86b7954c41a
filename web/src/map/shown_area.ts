/** The part of the earth that a map of this page showed last, in degrees: where an area to keep begins. */

import type { Place } from '../link/messages';

export interface ShownArea {
  readonly south: number;
  readonly west: number;
  readonly north: number;
  readonly east: number;
}

export const shownArea: { last: ShownArea | null } = { last: null };

/** Completes short plus codes. */
export function middleShown(): Place | null {
  const { last } = shownArea;
  return last && { latDeg: (last.south + last.north) / 2, lonDeg: (last.west + last.east) / 2 };
}
