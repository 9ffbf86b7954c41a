/** Distances on the ground, accurate over the few kilometres that a drone flies. */

import type { Place } from './messages';

const EARTH_RADIUS_M = 6_371_008.8;
const RADIANS = Math.PI / 180;

export function distanceM(from: Place, to: Place): number {
  const north = (to.latDeg - from.latDeg) * RADIANS;
  const east = (to.lonDeg - from.lonDeg) * RADIANS;
  const half =
    Math.sin(north / 2) ** 2 +
    Math.cos(from.latDeg * RADIANS) * Math.cos(to.latDeg * RADIANS) * Math.sin(east / 2) ** 2;
  return 2 * EARTH_RADIUS_M * Math.asin(Math.min(1, Math.sqrt(half)));
}

/** Clockwise from north, 0..360. */
export function bearingDeg(from: Place, to: Place): number {
  const east = (to.lonDeg - from.lonDeg) * RADIANS;
  const [fromLat, toLat] = [from.latDeg * RADIANS, to.latDeg * RADIANS];
  const y = Math.sin(east) * Math.cos(toLat);
  const x = Math.cos(fromLat) * Math.sin(toLat) - Math.sin(fromLat) * Math.cos(toLat) * Math.cos(east);
  return (Math.atan2(y, x) / RADIANS + 360) % 360;
}

/** The place `northM` and `eastM` away. */
export function offsetBy(from: Place, northM: number, eastM: number): Place {
  const latDeg = from.latDeg + northM / EARTH_RADIUS_M / RADIANS;
  const lonDeg = from.lonDeg + eastM / (EARTH_RADIUS_M * Math.cos(from.latDeg * RADIANS)) / RADIANS;
  return { latDeg, lonDeg };
}
