/** Why commands are disabled now, in words; empty if they are enabled. */

import { t } from '../languages/text';
import { mayCommand } from '../link/drone_view';
import type { Drone, User, UserRef } from '../link/wire_types';

export interface Situation {
  readonly drone: Drone;
  readonly user: User;
  readonly isConnected: boolean;
  readonly isHeard: boolean;
  /** The assistant whose turn it is. */
  readonly waitsFor: UserRef | null;
}

export function blockedWords({ drone, user, isConnected, isHeard, waitsFor }: Situation): string {
  if (!isConnected) return t('The connection to the tower is down. Nothing can be sent.');
  if (!drone.online) return t('{drone} is offline. Nothing can be sent.', { drone: drone.name });
  if (!mayCommand(drone, user)) {
    const whose = drone.holder
      ? t('{holder} has the controls.', { holder: drone.holder.name })
      : t('Take control to fly.');
    if (drone.taken_from?.id !== user.id) return whose;
    return drone.offered
      ? t('{holder} gives you {drone} back: accept the controls first.', {
          holder: drone.holder?.name ?? t('The admin'),
          drone: drone.name,
        })
      : t('{whose} They were taken from you.', { whose });
  }
  if (waitsFor) return t('{waitsFor} assists: your commands wait.', { waitsFor: waitsFor.name });
  return isHeard ? '' : t('No heartbeat from the autopilot yet.');
}

/** Who flies, for a user who may command the drone. */
export function flyingWords(drone: Drone, user: User): string {
  if (drone.holder?.id === user.id) {
    return drone.assistant
      ? t('You fly {drone}, {assistant} assists', { drone: drone.name, assistant: drone.assistant.name })
      : t('You fly {drone}', { drone: drone.name });
  }
  return t('You assist {holder} with {drone}: your commands come first', {
    holder: drone.holder?.name ?? t('nobody'),
    drone: drone.name,
  });
}
