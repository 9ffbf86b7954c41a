/** The inside of an area: which parts of a way leave it, and the shortest way between two places that does not. Pure. */

import type { Point } from '../ground';
import type { Spot } from '../plan_types';
import { Drawing } from './area';

/** A way along the border is inside. */
const EDGE_M = 0.5;

const apart = ([ax, ay]: Point, [bx, by]: Point): number => Math.hypot(bx - ax, by - ay);
const side = (a: Point, b: Point, c: Point): number => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
const between = (a: Point, b: Point, share: number): Point => [
  a[0] + (b[0] - a[0]) * share,
  a[1] + (b[1] - a[1]) * share,
];

function distanceToM(point: Point, a: Point, b: Point): number {
  const length2 = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2;
  if (length2 === 0) return apart(point, a);
  const along = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / length2;
  return apart(point, between(a, b, Math.max(0, Math.min(1, along))));
}

export class Inside {
  readonly #drawing: Drawing;
  readonly #ring: readonly Point[];
  /** The corners where the area bends inwards: shortest ways turn at these only. */
  readonly #bends: readonly Point[];
  readonly #seen = new Map<readonly Point[], Map<string, boolean>>();

  /** `area`: a clean outline. */
  constructor(area: readonly Spot[]) {
    this.#drawing = new Drawing(area, 0);
    const ring = area.map((corner) => this.#drawing.point(corner));
    const twice = ring.reduce((sum, [x, y], at) => {
      const [nextX, nextY] = ring[(at + 1) % ring.length]!;
      return sum + x * nextY - nextX * y;
    }, 0);
    this.#ring = ring;
    this.#bends = ring.filter(
      (corner, at) => side(ring.at(at - 1)!, corner, ring[(at + 1) % ring.length]!) * Math.sign(twice) < 0,
    );
  }

  /** The parts of the way that leave the area. */
  outside(from: Spot, to: Spot): (readonly [Spot, Spot])[] {
    const [a, b] = [this.#drawing.point(from), this.#drawing.point(to)];
    return this.#outside(a, b).map(([start, end]) => [
      this.#drawing.spot(between(a, b, start)),
      this.#drawing.spot(between(a, b, end)),
    ]);
  }

  /** Where to turn between two places, on the shortest way that stays inside; null if one of them is outside. */
  turns(from: Spot, to: Spot): Spot[] | null {
    const ends = [this.#drawing.point(from), this.#drawing.point(to)] as const;
    if (this.#outside(...ends).length === 0) return [];
    // Where a border touches itself, the way may lead through any corner.
    const way = this.#way(ends, this.#bends) ?? this.#way(ends, this.#ring);
    return way?.map((point) => this.#drawing.spot(point)) ?? null;
  }

  #way(ends: readonly [Point, Point], corners: readonly Point[]): Point[] | null {
    const places = [...ends, ...corners];
    const seen = this.#seen.get(corners) ?? new Map<string, boolean>();
    this.#seen.set(corners, seen);
    const lengths = places.map((_, at) => (at === 0 ? 0 : Infinity));
    const before = new Map<number, number>();
    const open = new Set(places.keys());
    for (;;) {
      const [here] = [...open].sort((one, other) => lengths[one]! - lengths[other]!);
      if (here === undefined || lengths[here] === Infinity) return null;
      if (here === 1) break;
      open.delete(here);
      for (const next of open) {
        const length = lengths[here]! + apart(places[here]!, places[next]!);
        if (length >= lengths[next]! || !this.#sees(here, next, places, seen)) continue;
        lengths[next] = length;
        before.set(next, here);
      }
    }
    const way: Point[] = [];
    for (let at = before.get(1)!; at !== 0; at = before.get(at)!) way.unshift(places[at]!);
    return way;
  }

  /** Corners see each other whatever the way: asked once. */
  #sees(one: number, other: number, places: readonly Point[], seen: Map<string, boolean>): boolean {
    const isLasting = one > 1 && other > 1;
    const key = `${Math.min(one, other)} ${Math.max(one, other)}`;
    const known = isLasting ? seen.get(key) : undefined;
    const isSeen = known ?? this.#outside(places[one]!, places[other]!).length === 0;
    if (isLasting) seen.set(key, isSeen);
    return isSeen;
  }

  /** Shares of the way from `a` to `b`. */
  #outside(a: Point, b: Point): (readonly [number, number])[] {
    const cuts = [0, 1];
    for (const [at, corner] of this.#ring.entries()) {
      const next = this.#ring[(at + 1) % this.#ring.length]!;
      const [left, right] = [side(corner, next, a), side(corner, next, b)];
      if (left === right) continue;
      const share = left / (left - right);
      if (share > 0 && share < 1) cuts.push(share);
    }
    cuts.sort((one, other) => one - other);
    const found: (readonly [number, number])[] = [];
    for (const [at, end] of cuts.slice(1).entries()) {
      const start = cuts[at]!;
      if (this.#holds(between(a, b, (start + end) / 2))) continue;
      const last = found.at(-1);
      if (last?.[1] === start) found.splice(-1, 1, [last[0], end]);
      else found.push([start, end]);
    }
    return found;
  }

  #holds(point: Point): boolean {
    const ring = this.#ring;
    let isIn = false;
    for (const [at, [x1, y1]] of ring.entries()) {
      const [x2, y2] = ring[(at + 1) % ring.length]!;
      const crosses = y1 > point[1] !== y2 > point[1];
      if (crosses && point[0] < x1 + ((point[1] - y1) / (y2 - y1)) * (x2 - x1)) isIn = !isIn;
    }
    return isIn || ring.some((corner, at) => distanceToM(point, corner, ring[(at + 1) % ring.length]!) <= EDGE_M);
  }
}
