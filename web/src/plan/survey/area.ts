/** Survey areas: whether they are valid, their size, and a plane with an axis along the lines. */

import { area } from '@turf/area';
import type { Polygon } from 'geojson';

import { t } from '../../languages/text';
import { Plane, type Point } from '../ground';
import { cleanOutline, crossingsOf, eastOf, wrappedE7 } from '../outline';
import { isOnEarth, latDegOf, lonDegOf, type Spot } from '../plan_types';

/** The area or a setting is impossible; the message is for people and says what to do. */
export class SurveyFault extends Error {
  override readonly name = 'SurveyFault';
}

/** Near the poles meridians converge and maps distort. */
const MAX_LAT_DEG = 85;

/** Throws if places span half the earth, are too near a pole, or are none. */
export function heldToOneSide(spots: readonly Spot[], what: string): void {
  if (!spots.every(isOnEarth)) throw new SurveyFault(t('{what} is not on earth.', { what }));
  const easts = spots.map((spot) => eastOf(spots[0]!, spot));
  if (Math.max(...easts) - Math.min(...easts) > 1_800_000_000) {
    throw new SurveyFault(t('{what} goes round half the earth.', { what }));
  }
  if (spots.some((spot) => Math.abs(latDegOf(spot)) > MAX_LAT_DEG)) {
    throw new SurveyFault(
      t('{what} is too near a pole: {maxLat} degrees of latitude is the most.', { what, maxLat: MAX_LAT_DEG }),
    );
  }
}

/** Longitudes go on beyond 180 degrees. */
function polygonOf(corners: readonly Spot[]): Polygon {
  const [first] = corners;
  const ring = [...corners, first!].map((spot) => [lonDegOf(first!) + eastOf(first!, spot) / 1e7, latDegOf(spot)]);
  return { type: 'Polygon', coordinates: [ring] };
}

export const areaM2 = (corners: readonly Spot[]): number => (corners.length < 3 ? 0 : area(polygonOf(corners)));

/** The cleaned corners. Throws a SurveyFault unless they are a simple outline. */
export function heldToOutline(drawn: readonly Spot[]): readonly Spot[] {
  const { corners } = cleanOutline(drawn);
  if (corners.length < 3) throw new SurveyFault(t('An area has three corners at least.'));
  heldToOneSide(corners, t('The area'));
  if (crossingsOf(corners).length > 0) {
    throw new SurveyFault(t('The outline of the area crosses itself: move its corners until it does not.'));
  }
  if (areaM2(corners) < 1) throw new SurveyFault(t('The area is smaller than a square metre.'));
  return corners;
}

/** A plane whose first axis runs along the lines of a survey, the second to the right of it. In metres. */
export class Drawing {
  readonly #plane: Plane;
  readonly #sin: number;
  readonly #cos: number;

  /** `angleDeg`: direction of the lines, clockwise from north. */
  constructor(corners: readonly Spot[], angleDeg: number) {
    const [first] = corners;
    const mean = (pick: (spot: Spot) => number): number =>
      Math.round(corners.reduce((sum, corner) => sum + pick(corner), 0) / corners.length);
    const lonE7 = wrappedE7(first!.lonE7 + mean((spot) => eastOf(first!, spot)));
    this.#plane = new Plane({ latE7: mean((spot) => spot.latE7), lonE7 });
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
