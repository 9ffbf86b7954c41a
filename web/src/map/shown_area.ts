/** The part of the earth that a map of this page showed last, in degrees: where an area to keep begins. */

export interface ShownArea {
  readonly south: number;
  readonly west: number;
  readonly north: number;
  readonly east: number;
}

export const shownArea: { last: ShownArea | null } = { last: null };
