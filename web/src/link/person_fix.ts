/** Where the person at this browser is, as its geolocation says, and how the tower is told. Knows no browser. */

/** The part of GeolocationPosition that counts. */
export interface Located {
  /** The browser's time of day when it was measured. */
  readonly timestamp: number;
  readonly coords: {
    readonly latitude: number;
    readonly longitude: number;
    readonly accuracy: number;
    readonly speed: number | null;
    readonly heading: number | null;
  };
}

/** From the person, over ground: as the tower has it (server/live/operations/person.py). */
export const MIN_DISTANCE_M = 8;
export const MAX_DISTANCE_M = 50;
export const USUAL_AWAY_M = 15;
const ACCURATE_M = 20;

/** How sure a fix must be to count, for a drone that is so far away. */
export const sureM = (awayM: number): number => Math.min(ACCURATE_M, awayM);

/** Milliseconds since it was measured; a clock that was set meanwhile makes nothing of the future. */
export const ageMs = ({ timestamp }: Located, nowWallMs: number): number => Math.max(0, nowWallMs - timestamp);

const known = (value: number | null): number | null => (value !== null && Number.isFinite(value) ? value : null);
const CLOCK_MODULO = 2 ** 32;

/** `monotonicMs`: the clock of the stamps before frames, by which the tower sees how late this comes. */
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
