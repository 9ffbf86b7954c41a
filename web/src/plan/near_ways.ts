/**
 * Geometry of two flying drones, in metres and seconds: when they are near each other, and where their paths are
 * nearest. Pure.
 */

import type { Point } from './ground';

export type Solid = readonly [east: number, north: number, up: number];

/** One drone relative to the other. */
export interface Moving {
  readonly place: Solid;
  /** Per second. */
  readonly speed: Solid;
}

export interface Near {
  readonly fromS: number;
  readonly toS: number;
  /** When they are nearest horizontally within that time, and their distance then. */
  readonly closestS: number;
  readonly horizontalM: number;
  readonly verticalM: number;
}

const STILL = 1e-9;

/** The times within the next `forS` seconds when both distances are below the given ones; null: none. */
export function whenNear({ place, speed }: Moving, horizontalM: number, verticalM: number, forS: number): Near | null {
  const [x, y, z] = place;
  const [u, v, w] = speed;
  let [fromS, toS] = [0, forS];
  const square = u * u + v * v;
  const closing = x * u + y * v;
  if (horizontalM !== Infinity) {
    const beyond = x * x + y * y - horizontalM * horizontalM;
    if (square <= STILL) {
      if (beyond >= 0) return null;
    } else {
      const root = closing * closing - square * beyond;
      if (root <= 0) return null;
      fromS = Math.max(fromS, (-closing - Math.sqrt(root)) / square);
      toS = Math.min(toS, (-closing + Math.sqrt(root)) / square);
    }
  }
  if (Math.abs(w) <= STILL) {
    if (Math.abs(z) >= verticalM) return null;
  } else {
    const [one, other] = [(-verticalM - z) / w, (verticalM - z) / w];
    fromS = Math.max(fromS, Math.min(one, other));
    toS = Math.min(toS, Math.max(one, other));
  }
  if (fromS >= toS) return null;
  const closestS = square <= STILL ? fromS : Math.min(Math.max(-closing / square, fromS), toS);
  const apart = Math.hypot(x + u * closestS, y + v * closestS);
  return { fromS, toS, closestS, horizontalM: apart, verticalM: Math.abs(z + w * closestS) };
}

export interface Segment {
  readonly from: Solid;
  readonly to: Solid;
}

export interface Touch {
  /** The position along each of the two, 0 to 1. */
  readonly parts: readonly [number, number];
  readonly horizontalM: number;
  readonly verticalM: number;
  /** Midway between the two places. */
  readonly at: Point;
}

const clamp = (value: number): number => Math.min(1, Math.max(0, value));
const minus = (a: Solid, b: Solid): Solid => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a: Solid, b: Solid): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const along = ({ from, to }: Segment, part: number): Solid => [
  from[0] + (to[0] - from[0]) * part,
  from[1] + (to[1] - from[1]) * part,
  from[2] + (to[2] - from[2]) * part,
];

/** Where two straight segments are nearest, with a metre of height weighted as `heightCounts` horizontal metres. */
export function closestOfSegments(one: Segment, other: Segment, heightCounts: number): Touch {
  const scaled = ({ from, to }: Segment): Segment => ({
    from: [from[0], from[1], from[2] * heightCounts],
    to: [to[0], to[1], to[2] * heightCounts],
  });
  const parts = partsOf(scaled(one), scaled(other));
  const [p, q] = [along(one, parts[0]), along(other, parts[1])];
  return {
    parts,
    horizontalM: Math.hypot(p[0] - q[0], p[1] - q[1]),
    verticalM: Math.abs(p[2] - q[2]),
    at: [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2],
  };
}

/** The distance is quadratic in both positions: finds the minimum along each edge of the unit square and inside it. */
function partsOf(one: Segment, other: Segment): [number, number] {
  const [d1, d2, r] = [minus(one.to, one.from), minus(other.to, other.from), minus(one.from, other.from)];
  const [a, e, b, c, f] = [times(d1, d1), times(d2, d2), times(d1, d2), times(d1, r), times(d2, r)];
  const onOther = (s: number): [number, number] => [s, e > STILL ? clamp((b * s + f) / e) : 0];
  const onOne = (t: number): [number, number] => [a > STILL ? clamp((b * t - c) / a) : 0, t];
  const candidates = [onOther(0), onOther(1), onOne(0), onOne(1)];
  const determinant = a * e - b * b;
  if (determinant > STILL * a * e && a > STILL && e > STILL) {
    const [s, t] = [(b * f - c * e) / determinant, (a * f - b * c) / determinant];
    if (s > 0 && s < 1 && t > 0 && t < 1) candidates.push([s, t]);
  }
  const distance = ([s, t]: [number, number]): number => {
    const apart = minus(along(one, s), along(other, t));
    return times(apart, apart);
  };
  return candidates.reduce((best, next) => (distance(next) < distance(best) ? next : best));
}
