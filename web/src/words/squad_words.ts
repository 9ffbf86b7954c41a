/** Texts of the squad list about a drone, besides its numbers. */

import { t } from '../languages/text';
import type { FlightValues } from '../link/flight_values';
import type { Drone, User } from '../link/wire_types';
import { duration, UNKNOWN } from './format';

/** A position may be this old and still be current: reduced streams and drones off the map arrive once a second. */
export const STALE_MS = 5_000;

export function holderWords({ holder }: Drone, user: Pick<User, 'id'>): string {
  if (holder === null) return t('Free');
  return holder.id === user.id ? t('You') : holder.name;
}

/** Its mode, or why there is none. */
export function statusWords(drone: Drone, { state, mode, heartbeatAgeMs }: FlightValues): string {
  if (!drone.may_watch) return t('View taken');
  if (state !== 'lost') return mode ?? UNKNOWN;
  if (!drone.online) return t('Offline');
  return heartbeatAgeMs === null ? t('Autopilot not heard') : t('Silent');
}

/** The age of its numbers, once they are old; empty while they are fresh or missing. */
export function ageWords({ positionAgeMs, heartbeatAgeMs }: FlightValues): string {
  const ages = [positionAgeMs, heartbeatAgeMs].filter((age) => age !== null);
  const youngestMs = Math.min(...ages);
  return ages.length > 0 && youngestMs > STALE_MS ? t('{youngest} old', { youngest: duration(youngestMs) }) : '';
}
