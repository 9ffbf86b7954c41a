/** Reads untrusted JSON. */

import { isOnEarth, spotOf, type Spot } from '../plan_types';

export type JsonObject = Readonly<Record<string, unknown>>;

export const isObject = (value: unknown): value is JsonObject =>
  typeof value === 'object' && value !== null && !Array.isArray(value);

export const objectsIn = (value: unknown): JsonObject[] => (Array.isArray(value) ? value.filter(isObject) : []);

export const isNumber = (value: unknown): value is number => Number.isFinite(value);

/** Degrees to a place on earth, or null. */
export function placeOf(latDeg: unknown, lonDeg: unknown): Spot | null {
  if (!isNumber(latDeg) || !isNumber(lonDeg)) return null;
  const spot = spotOf(latDeg, lonDeg);
  return isOnEarth(spot) ? spot : null;
}

/** `[latitude, longitude]`, as QGroundControl writes them. */
export const latLonOf = (value: unknown): Spot | null => (Array.isArray(value) ? placeOf(value[0], value[1]) : null);
