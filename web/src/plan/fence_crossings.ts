/**
 * Where a path leaves its fence: exact, not sampled. Cuts each leg at every border and tests the middle of each piece.
 */

import { booleanPointInPolygon } from '@turf/boolean-point-in-polygon';
import type { Polygon } from 'geojson';

import type { Leg } from './flown_path';
import { distanceM, Plane, type Point } from './ground';
import type { FenceShape, Spot } from './plan_types';

export type Breach =
  /** Outside every inclusion area. */
  | 'outside'
  /** Inside one inclusion area, outside another: some autopilots require all. */
  | 'outside-one'
  /** Inside an exclusion area. */
  | 'forbidden';

interface FlatPolygon {
  readonly inclusion: boolean;
  readonly ring: readonly Point[];
  readonly area: Polygon;
}
interface FlatCircle {
  readonly inclusion: boolean;
  readonly centre: Point;
  readonly radiusM: number;
}
type Flat = FlatPolygon | FlatCircle;

const holds = (shape: Flat, point: Point): boolean =>
  'ring' in shape
    ? booleanPointInPolygon([...point], shape.area)
    : Math.hypot(point[0] - shape.centre[0], point[1] - shape.centre[1]) <= shape.radiusM;

/** Positions on the path from `a` to `b` (0 to 1) where it meets the border. */
function meetings(shape: Flat, a: Point, b: Point): number[] {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  if ('ring' in shape) {
    return shape.ring.flatMap((corner, at) => {
      const next = shape.ring[(at + 1) % shape.ring.length]!;
      const [ex, ey] = [next[0] - corner[0], next[1] - corner[1]];
      const cross = dx * ey - dy * ex;
      if (cross === 0) return [];
      const [fx, fy] = [corner[0] - a[0], corner[1] - a[1]];
      const along = (fx * ey - fy * ex) / cross;
      const beside = (fx * dy - fy * dx) / cross;
      return along >= 0 && along <= 1 && beside >= 0 && beside <= 1 ? [along] : [];
    });
  }
  const [fx, fy] = [a[0] - shape.centre[0], a[1] - shape.centre[1]];
  const length2 = dx * dx + dy * dy;
  if (length2 === 0) return [];
  const half = fx * dx + fy * dy;
  const rest = half * half - length2 * (fx * fx + fy * fy - shape.radiusM ** 2);
  if (rest < 0) return [];
  const root = Math.sqrt(rest);
  return [(-half - root) / length2, (-half + root) / length2].filter((along) => along >= 0 && along <= 1);
}

function breachAt(shapes: readonly Flat[], point: Point): Breach | null {
  const areas = shapes.filter((shape) => shape.inclusion);
  if (shapes.some((shape) => !shape.inclusion && holds(shape, point))) return 'forbidden';
  const held = areas.filter((shape) => holds(shape, point)).length;
  if (areas.length > 0 && held === 0) return 'outside';
  return held < areas.length ? 'outside-one' : null;
}

const WORST: readonly Breach[] = ['forbidden', 'outside', 'outside-one'];

export class FenceCheck {
  readonly #plane: Plane;
  readonly #shapes: readonly Flat[];

  /** `middle`: near the flown area. */
  constructor(shapes: readonly FenceShape[], middle: Spot) {
    this.#plane = new Plane(middle);
    const flat = (spot: Spot): Point => this.#plane.point(spot);
    this.#shapes = shapes.map((shape): Flat => {
      const { inclusion } = shape;
      if (shape.shape === 'circle') return { inclusion, centre: flat(shape.centre), radiusM: shape.radiusM };
      const ring = shape.corners.map(flat);
      const coordinates = [[...ring, ...ring.slice(0, 1)].map((corner) => [...corner])];
      return { inclusion, ring, area: { type: 'Polygon', coordinates } };
    });
  }

  at(spot: Spot): Breach | null {
    return breachAt(this.#shapes, this.#plane.point(spot));
  }

  /** The worst breach on a leg. */
  on(leg: Pick<Leg, 'from' | 'to'>): Breach | null {
    if (this.#shapes.length === 0) return null;
    if (distanceM(leg.from, leg.to) === 0) return this.at(leg.to);
    const [a, b] = [this.#plane.point(leg.from), this.#plane.point(leg.to)];
    const cuts = [0, ...this.#shapes.flatMap((shape) => meetings(shape, a, b)), 1].sort((one, other) => one - other);
    const seen = new Set<Breach | null>();
    for (const [at, cut] of cuts.slice(1).entries()) {
      const middle = (cut + cuts[at]!) / 2;
      if (cut - cuts[at]! < 1e-9) continue;
      seen.add(breachAt(this.#shapes, [a[0] + (b[0] - a[0]) * middle, a[1] + (b[1] - a[1]) * middle]));
    }
    return WORST.find((breach) => seen.has(breach)) ?? null;
  }
}
