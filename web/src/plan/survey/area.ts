/** Survey areas: whether they are valid, their size, and a plane with an axis along the lines. */

import { area } from '@turf/area';
import { kinks } from '@turf/kinks';
import type { Polygon } from 'geojson';

import { t } from '../../languages/text';
import { Plane, type Point } from '../ground';
import { isOnEarth, latDegOf, lonDegOf, type Spot } from '../plan_types';

/** The area or a setting is impossible; the message is for people and says what to do. */
export class SurveyFault extends Error {
  override readonly name = 'SurveyFault';
}

/** Near the poles meridians converge and maps distort. */
const MAX_LAT_DEG = 85;

/** Throws if places lie on both sides of the 180th meridian, too near a pole, or if there are none. */
export function heldToOneSide(spots: readonly Spot[], what: string): void {
  if (!spots.every(isOnEarth)) throw new SurveyFault(t('{what} is not on earth.', { what }));
  const lons = spots.map(lonDegOf);
  if (Math.max(...lons) - Math.min(...lons) > 180) {
    throw new SurveyFault(t('{what} crosses the 180th meridian: draw one on each side of it.', { what }));
  }
  if (spots.some((spot) => Math.abs(latDegOf(spot)) > MAX_LAT_DEG)) {
    throw new SurveyFault(
      t('{what} is too near a pole: {maxLat} degrees of latitude is the most.', { what, maxLat: MAX_LAT_DEG }),
    );
  }
}

function polygonOf(corners: readonly Spot[]): Polygon {
  const ring = [...corners, corners[0]!].map((spot) => [lonDegOf(spot), latDegOf(spot)]);
  return { type: 'Polygon', coordinates: [ring] };
}

export const areaM2 = (corners: readonly Spot[]): number => (corners.length < 3 ? 0 : area(polygonOf(corners)));

/** Throws a SurveyFault unless it is a simple outline on one side of the 180th meridian. */
export function heldToOutline(corners: readonly Spot[]): void {
  if (corners.length < 3) throw new SurveyFault(t('An area has three corners at least.'));
  heldToOneSide(corners, t('The area'));
  if (kinks(polygonOf(corners)).features.length > 0) {
    throw new SurveyFault(t('The outline of the area crosses itself: move its corners until it does not.'));
  }
  if (areaM2(corners) < 1) throw new SurveyFault(t('The area is smaller than a square metre.'));
}

/** A plane whose first axis runs along the lines of a survey, the second to the right of it. In metres. */
export class Drawing {
  readonly #plane: Plane;
  readonly #sin: number;
  readonly #cos: number;

  /** `angleDeg`: direction of the lines, clockwise from north. */
  constructor(corners: readonly Spot[], angleDeg: number) {
    const middle = (pick: (spot: Spot) => number): number =>
      Math.round(corners.reduce((sum, corner) => sum + pick(corner), 0) / corners.length);
    this.#plane = new Plane({ latE7: middle((spot) => spot.latE7), lonE7: middle((spot) => spot.lonE7) });
    this.#sin = Math.sin((angleDeg * Math.PI) / 180);
    this.#cos = Math.cos((angleDeg * Math.PI) / 180);
  }

  point(spot: Spot): Point {
    const [east, north] = this.#plane.point(spot);
    return [east * this.#sin + north * this.#cos, east * this.#cos - north * this.#sin];
  }

  spot([along, across]: Point): Spot {
    return this.#plane.spot([along * this.#sin + across * this.#cos, along * this.#cos - across * this.#sin]);
  }
}
