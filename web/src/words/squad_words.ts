/** Texts of the squad list about a drone, besides its numbers. */

import type { FlightValues } from '../link/flight_values';
import type { Drone, User } from '../link/wire_types';
import { duration, UNKNOWN } from './format';

/** A position may be this old and still be current: reduced streams and drones off the map arrive once a second. */
export const STALE_MS = 5_000;

export function holderWords({ holder }: Drone, user: Pick<User, 'id'>): string {
  if (holder === null) return 'Free';
  return holder.id === user.id ? 'You' : holder.name;
}

/** Its mode, or why there is none. */
export function statusWords(drone: Drone, { state, mode, heartbeatAgeMs }: FlightValues): string {
  if (!drone.may_watch) return 'View taken';
  if (state !== 'lost') return mode ?? UNKNOWN;
  if (!drone.online) return 'Offline';
  return heartbeatAgeMs === null ? 'Autopilot not heard' : 'Silent';
}

/** The age of its numbers, once they are old; empty while they are fresh or missing. */
export function ageWords({ positionAgeMs, heartbeatAgeMs }: FlightValues): string {
  const ages = [positionAgeMs, heartbeatAgeMs].filter((age) => age !== null);
  const youngestMs = Math.min(...ages);
  return ages.length > 0 && youngestMs > STALE_MS ? `${duration(youngestMs)} old` : '';
}
