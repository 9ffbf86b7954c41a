/** Carries out one action at several drones at once, and keeps each answer. */

import { t } from './languages/text';
import { waitsFor } from './link/assist_turns';
import type { Outcome } from './link/outcome';
import type { Vehicle } from './link/vehicle';
import type { User } from './link/wire_types';
import { answerOf, ACTION_WORDS, wayToControls, type Answer, type SquadAction } from './squad/squad_action';
import { tower } from './tower.svelte';
import { blockedWords } from './words/blocked';

const DO: Record<SquadAction, (vehicle: Vehicle) => Promise<Outcome>> = {
  hold: (vehicle) => vehicle.sendHold(),
  return: (vehicle) => vehicle.command(ACTION_WORDS.return.verb, { command: 'rtl' }),
  land: (vehicle) => vehicle.command(ACTION_WORDS.land.verb, { command: 'land' }),
};

/** Why this user cannot command this drone now; empty if they can. */
export function blockedNow(droneId: number, user: User): string {
  const vehicle = tower.vehicles.get().get(droneId);
  if (!vehicle) return t('It is no longer in your squad.');
  const drone = vehicle.drone.get();
  return blockedWords({
    drone,
    user,
    isConnected: tower.live.state.get().phase === 'open',
    isHeard: vehicle.values(tower.clock.nowMs()).heartbeatAgeMs !== null,
    waitsFor: waitsFor(drone, tower.assist.turns.get().get(droneId), user),
  });
}

/** For the audit trail of the tower: in English, whoever acts. */
const REASONS: Readonly<Record<SquadAction, string>> = {
  hold: 'Hold of several drones',
  return: 'Return of several drones',
  land: 'Land of several drones',
};

async function one(droneId: number, action: SquadAction, user: User, takesFirst: boolean): Promise<Answer> {
  const vehicle = tower.vehicles.get().get(droneId);
  if (!vehicle) return { kind: 'refused', why: t('It is no longer in your squad.') };
  const drone = vehicle.drone.get();
  const way = takesFirst ? wayToControls(drone, user) : null;
  try {
    if (way) await tower.control(droneId, way, { reason: REASONS[action] });
  } catch (error) {
    return { kind: 'refused', why: error instanceof Error ? error.message : String(error) };
  }
  const blocked = blockedNow(droneId, user);
  if (blocked) return { kind: 'refused', why: blocked };
  return answerOf(drone.name, await DO[action](vehicle));
}

/** `onanswer` is called for every drone: at once with the pending state, then with the outcome. */
export async function performAll(
  droneIds: readonly number[],
  action: SquadAction,
  user: User,
  takesFirst: boolean,
  onanswer: (droneId: number, answer: Answer) => void,
): Promise<void> {
  await Promise.all(
    droneIds.map(async (droneId) => {
      onanswer(droneId, { kind: 'waiting', why: '' });
      onanswer(droneId, await one(droneId, action, user, takesFirst));
    }),
  );
}
