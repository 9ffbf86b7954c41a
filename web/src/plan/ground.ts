/** Places on earth and a local plane in metres: the planner's measurements. Uses turf, on the sphere. */

import { bearing } from '@turf/bearing';
import { destination } from '@turf/destination';
import { distance } from '@turf/distance';

import { e7Of, latDegOf, lonDegOf, type Spot } from './plan_types';

const METRES = { units: 'meters' } as const;
const degrees = (spot: Spot): [number, number] => [lonDegOf(spot), latDegOf(spot)];

export const distanceM = (from: Spot, to: Spot): number => distance(degrees(from), degrees(to), METRES);

/** Clockwise from north, -180 to 180. */
export const bearingDeg = (from: Spot, to: Spot): number => bearing(degrees(from), degrees(to));

export function spotAt(from: Spot, metres: number, bearing: number): Spot {
  const [lon, lat] = destination(degrees(from), metres, bearing, METRES).geometry.coordinates;
  // Turf continues beyond 180 degrees.
  const wrapped = ((((lon! + 180) % 360) + 360) % 360) - 180;
  return { latE7: e7Of(lat!), lonE7: e7Of(wrapped) };
}

/** Metres east and north of a centre. */
export type Point = readonly [number, number];

/** Distances and bearings from its centre are exact; those between other points nearly, within a few kilometres. */
export class Plane {
  readonly #middle: Spot;

  constructor(middle: Spot) {
    this.#middle = middle;
  }

  point(spot: Spot): Point {
    const metres = distanceM(this.#middle, spot);
    const angle = (bearingDeg(this.#middle, spot) * Math.PI) / 180;
    return [metres * Math.sin(angle), metres * Math.cos(angle)];
  }

  spot([east, north]: Point): Spot {
    return spotAt(this.#middle, Math.hypot(east, north), (Math.atan2(east, north) * 180) / Math.PI);
  }
}

/** The difference of two bearings, 0 to 180. */
export function turnDeg(from: number, to: number): number {
  const turn = Math.abs(from - to) % 360;
  return turn > 180 ? 360 - turn : turn;
}
