/**
 * The one cleaner of outlines, for surveys, fences, zones and corridors: takes corners once that are drawn twice, drops
 * ways out and back, finds where an outline crosses itself, and puts its corners in order. Works across the
 * 180th meridian. Pure.
 */

import type { Spot } from './plan_types';

/** Corners nearer than this are one: a double click. */
const SAME_M = 0.1;
/** A corner this near to the line between its neighbours is on it. */
const STRAIGHT_M = 0.01;
const METRES_PER_E7 = 0.0111195;
const TURN_E7 = 3_600_000_000;
/** A tangle has as many crossings as pairs of edges. */
const MAX_CROSSINGS = 20;
/** Putting more corners than this in order would hold up the page. */
const MAX_ORDERED = 100;

export interface Crossing {
  /** The corners (from 0) at which the two edges begin. */
  readonly edges: readonly [number, number];
  readonly spot: Spot;
}

export interface CleanOutline {
  readonly corners: readonly Spot[];
  /** Corners left out: at the same place as the one before, or where the outline only goes out and back. */
  readonly doubled: number;
}

type Point = readonly [x: number, y: number];

/** Degrees east of the first place, across the 180th meridian too; in units of 1e-7. */
export const eastOf = (first: Spot, spot: Spot): number => {
  const east = (spot.lonE7 - first.lonE7) % TURN_E7;
  return east > TURN_E7 / 2 ? east - TURN_E7 : east < -TURN_E7 / 2 ? east + TURN_E7 : east;
};

/** Back to -180 to 180 degrees. */
export const wrappedE7 = (lonE7: number): number => {
  const turned = (((lonE7 + TURN_E7 / 2) % TURN_E7) + TURN_E7) % TURN_E7;
  return Math.round(turned - TURN_E7 / 2);
};

/** Metres in a flat frame: straight lines stay straight, which is all that is asked here. */
function flat(spots: readonly Spot[]): Point[] {
  const [first] = spots;
  if (!first) return [];
  const shrink = Math.cos(((first.latE7 / 1e7) * Math.PI) / 180);
  return spots.map((spot) => [
    eastOf(first, spot) * shrink * METRES_PER_E7,
    (spot.latE7 - first.latE7) * METRES_PER_E7,
  ]);
}

const apart = ([ax, ay]: Point, [bx, by]: Point): number => Math.hypot(bx - ax, by - ay);
/** Twice the area of the triangle: above zero if `c` is left of the way from `a` to `b`. */
const side = (a: Point, b: Point, c: Point): number => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);

/** Places along a line, each once where several follow each other. */
export function cleanLine(spots: readonly Spot[]): CleanOutline {
  const points = flat(spots);
  const kept: number[] = [];
  for (const [at, point] of points.entries()) {
    const before = kept.at(-1);
    if (before === undefined || apart(points[before]!, point) >= SAME_M) kept.push(at);
  }
  return { corners: kept.map((at) => spots[at]!), doubled: spots.length - kept.length };
}

/** Without the first corner again at the end, corners drawn twice, and ways out and back. */
export function cleanOutline(spots: readonly Spot[]): CleanOutline {
  const points = flat(spots);
  const kept = [...points.keys()];
  const at = (place: number): Point => points[kept.at(place % kept.length)!]!;
  let doubled = 0;
  for (let place = 0; kept.length > 2 && place < kept.length;) {
    const [before, point, after] = [at(place - 1), at(place), at(place + 1)];
    const isDouble = apart(before, point) < SAME_M;
    const off = Math.abs(side(before, after, point)) / Math.max(apart(before, after), SAME_M);
    const onward = (point[0] - before[0]) * (after[0] - point[0]) + (point[1] - before[1]) * (after[1] - point[1]);
    if (!isDouble && (off >= STRAIGHT_M || onward > 0)) {
      place += 1;
      continue;
    }
    doubled += 1;
    // Of the first and the last corner at one place, the first stays.
    kept.splice(isDouble && place === 0 ? kept.length - 1 : place, 1);
    place = Math.max(0, place - 2);
  }
  return { corners: kept.map((one) => spots[one]!), doubled };
}

/** Where edges without a common corner cross, at most 20 of them. Edges that only touch leave inside and outside as they are. */
export function crossingsOf(corners: readonly Spot[]): Crossing[] {
  const points = flat(corners);
  const count = points.length;
  const found: Crossing[] = [];
  for (let one = 0; one < count; one += 1) {
    for (let other = one + 2; other < count && found.length < MAX_CROSSINGS; other += 1) {
      if (one === 0 && other === count - 1) continue;
      const along = crossing(points[one]!, points[one + 1]!, points[other]!, points[(other + 1) % count]!);
      if (along === null) continue;
      const [from, to] = [corners[one]!, corners[one + 1]!];
      const latE7 = Math.round(from.latE7 + along * (to.latE7 - from.latE7));
      const spot = { latE7, lonE7: wrappedE7(from.lonE7 + along * eastOf(from, to)) };
      found.push({ edges: [one, other], spot });
    }
  }
  return found;
}

/** The share of the way from `a` to `b` at which it crosses that from `c` to `d`; null if it does not. */
function crossing(a: Point, b: Point, c: Point, d: Point): number | null {
  const [left, right] = [side(c, d, a), side(c, d, b)];
  if (left * right >= 0 || side(a, b, c) * side(a, b, d) >= 0) return null;
  return left / (left - right);
}

/**
 * The same corners in an order in which the outline does not cross itself: turns the part between two crossing edges
 * round, until none do. Each turn makes the outline shorter, so it ends. For at most `MAX_ORDERED` corners.
 */
export function inOrder(spots: readonly Spot[]): readonly Spot[] {
  let ordered = cleanOutline(spots).corners;
  for (;;) {
    const [first] = crossingsOf(ordered);
    if (!first) return ordered;
    const [one, other] = first.edges;
    ordered = [
      ...ordered.slice(0, one + 1),
      ...ordered.slice(one + 1, other + 1).reverse(),
      ...ordered.slice(other + 1),
    ];
  }
}

/** Whether an outline crosses itself and has few enough corners to be put in order. */
export const mayOrder = (corners: readonly Spot[]): boolean =>
  corners.length <= MAX_ORDERED && crossingsOf(cleanOutline(corners).corners).length > 0;
