/**
 * The position of the person at this browser, from its geolocation, and the report to the tower. Independent of browser
 * APIs.
 */

/** The part of GeolocationPosition in use. */
export interface Located {
  /** The browser's time of day at the measurement. */
  readonly timestamp: number;
  readonly coords: {
    readonly latitude: number;
    readonly longitude: number;
    readonly accuracy: number;
    readonly speed: number | null;
    readonly heading: number | null;
  };
}

/** From the person, over ground; the tower's limit (server/operations/core/person.py). */
export const MIN_DISTANCE_M = 8;
export const MAX_DISTANCE_M = 50;
export const USUAL_AWAY_M = 15;
const ACCURATE_M = 20;

/** The accuracy that a fix needs for a drone at this distance. */
export const sureM = (awayM: number): number => Math.min(ACCURATE_M, awayM);

/** Milliseconds since the measurement; a fix in the future, after a clock change, counts as age 0. */
export const ageMs = ({ timestamp }: Located, nowWallMs: number): number => Math.max(0, nowWallMs - timestamp);

const known = (value: number | null): number | null => (value !== null && Number.isFinite(value) ? value : null);
const CLOCK_MODULO = 2 ** 32;

/** `monotonicMs`: the clock of the stamps before frames; the tower measures the delay with it. */
export function personFixText(droneId: number, located: Located, nowWallMs: number, monotonicMs: number): string {
  const { latitude, longitude, accuracy, speed, heading } = located.coords;
  return JSON.stringify({
    type: 'person_fix',
    drone_id: droneId,
    lat: latitude,
    lon: longitude,
    accuracy_m: accuracy,
    age_ms: Math.min(ageMs(located, nowWallMs), 3_600_000),
    sent_ms: Math.floor(monotonicMs) % CLOCK_MODULO,
    speed_m_s: known(speed),
    heading_deg: known(heading),
  });
}
