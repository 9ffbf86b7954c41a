/** Two flights on one timeline, aligned at their take-offs. Pure. */

import type { Place } from '../link/messages';
import { distanceM } from '../link/geometry';

/** On the map: the other flight may be one of the same drone. */
export const BESIDE_ID = -1;

export interface FlightTimes {
  readonly fromMs: number;
  readonly wholeToMs: number;
  readonly takeOffMs: number;
}

/** The timeline of both, by the clock of the first. */
export interface Pair {
  readonly fromMs: number;
  readonly toMs: number;
  /** What added to a moment of the first gives that of the other. */
  readonly laterMs: number;
}

/** Null until something is known of both. */
export function paired(one: FlightTimes, other: FlightTimes): Pair | null {
  if (one.fromMs === 0 || other.fromMs === 0) return null;
  const laterMs = other.takeOffMs - one.takeOffMs;
  return {
    fromMs: Math.min(one.fromMs, other.fromMs - laterMs),
    toMs: Math.max(one.wholeToMs, other.wholeToMs - laterMs),
    laterMs,
  };
}

/** Over ground; null while one has no position. */
export const apartM = (one: Place | null, other: Place | null): number | null =>
  one && other ? distanceM(one, other) : null;
