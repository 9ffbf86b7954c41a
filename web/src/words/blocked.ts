/** Why commands are disabled now, in words; empty if they are enabled. */

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
  if (!isConnected) return 'The connection to the tower is down. Nothing can be sent.';
  if (!drone.online) return `${drone.name} is offline. Nothing can be sent.`;
  if (!mayCommand(drone, user)) {
    const whose = drone.holder ? `${drone.holder.name} has the controls.` : 'Take up the controls to fly.';
    if (drone.taken_from?.id !== user.id) return whose;
    return drone.offered
      ? `${drone.holder?.name ?? 'The admin'} gives you ${drone.name} back: accept the controls first.`
      : `${whose} They were taken from you.`;
  }
  if (waitsFor) return `${waitsFor.name} assists: your commands wait.`;
  return isHeard ? '' : 'No heartbeat from the autopilot yet.';
}

/** Who flies, for a user who may command the drone. */
export function flyingWords(drone: Drone, user: User): string {
  if (drone.holder?.id === user.id) {
    return drone.assistant ? `You fly ${drone.name}, ${drone.assistant.name} assists` : `You fly ${drone.name}`;
  }
  return `You assist ${drone.holder?.name ?? 'nobody'} with ${drone.name}: your commands come first`;
}
