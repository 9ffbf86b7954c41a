/** The one alert of the page itself: it has lost the tower, so nothing that it shows is new. Pure. */

import { t } from '../languages/text';
import type { OwnAlert } from './alerts';
import { mayCommand } from './drone_view';
import type { Drone, User } from './wire_types';

/** Below this a reconnection is a matter of course. */
export const ALONE_AFTER_MS = 3_000;

/** `deafSinceMs`: since when the tower is silent; null: it is heard. */
export function aloneWords(
  deafSinceMs: number | null,
  drones: readonly Drone[],
  user: Pick<User, 'id'> | null,
  nowMs: number,
): OwnAlert | null {
  if (deafSinceMs === null || user === null || nowMs - deafSinceMs < ALONE_AFTER_MS) return null;
  const flown = drones.filter((drone) => mayCommand(drone, user) && drone.airborne !== false && drone.online);
  const words = t('This page has lost the tower. What it shows is old.');
  if (flown.length === 0) return { words, severity: 'warning' };
  return {
    words: t('{words} You control {flown}.', { words, flown: flown.map(({ name }) => name).join(', ') }),
    severity: 'critical',
  };
}
