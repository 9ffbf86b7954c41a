/**
 * Commands to a drone through the tower (`POST /drones/{id}/commands`), each an operation with a result in words.
 * Heights are metres above home.
 */

import { t } from '../languages/text';
import type { Outcome } from './outcome';
import type { Operation } from './operation_types';
import { isOver, type Operations } from './operations';
import { RestError } from './rest';
import type { BodyOf, Schemas } from './rest_types';

export type DroneCommand = BodyOf<'POST', typeof COMMANDS>;
/** Keeps a position relative to another drone until something ends it; then the drone holds. */
export type FollowCommand = Schemas['Follow'];
/** The person's position; the live channel reports it from then on. */
export type FollowMeCommand = Schemas['FollowMe'];

/** Flies to a place and lands there. */
export type LandAtCommand = Schemas['LandAt'];

const COMMANDS = '/drones/{drone_id}/commands';

function outcomeOf({ state, seen, words: said, item }: Operation): Outcome {
  const words = said || t('The tower did not report the result.');
  const isDone = state === 'done';
  // What an earlier item of the mission had set was not taken again.
  if (!isDone && typeof item === 'number') return { kind: 'reported', isDone, words, problem: 'state-not-restored' };
  if (state === 'timed_out') return { kind: 'reported', isDone, words, doubt: 'no-answer' };
  return { kind: 'reported', isDone, words, ...(isDone && seen === false ? { doubt: 'unconfirmed' } : {}) };
}

/** Runs a command and returns its outcome in words. */
export async function outcomeOfCommand(
  operations: Operations,
  droneId: number,
  command: DroneCommand,
): Promise<Outcome> {
  try {
    return outcomeOf(await commandDrone(operations, droneId, command));
  } catch (error) {
    const words = error instanceof Error ? error.message : String(error);
    return { kind: 'reported', isDone: false, words, ...(error instanceof RestError ? { problem: error.slug } : {}) };
  }
}

/**
 * Resolves to the operation as it begins; it ends when the drone stops following. Raises RestError if the tower
 * refuses.
 */
export const followLeader = (operations: Operations, droneId: number, command: FollowCommand): Promise<Operation> =>
  operations.start('POST', COMMANDS, { path: { drone_id: droneId }, body: command });

/** As `followLeader`, for a person. */
export const followPerson = (operations: Operations, droneId: number, command: FollowMeCommand): Promise<Operation> =>
  operations.start('POST', COMMANDS, { path: { drone_id: droneId }, body: command });

/** As `followLeader`: it ends when the drone lands at the place, or when something keeps it from landing there. */
export const landAt = (operations: Operations, droneId: number, command: LandAtCommand): Promise<Operation> =>
  operations.start('POST', COMMANDS, { path: { drone_id: droneId }, body: command });

/** Resolves to the operation as soon as the drone follows or is on its way, or when it ends before that. */
export function begunOrEnded(operations: Operations, id: string): Promise<Operation | null> {
  return new Promise((resolve) => {
    let stop: (() => void) | null = null;
    const look = (all: ReadonlyMap<string, Operation>): void => {
      const one = all.get(id) ?? null;
      // A duration, or a distance, is reported only from then on.
      if (one && !isOver(one) && one.total === 0) return;
      resolve(one);
      stop?.();
      stop = () => undefined;
    };
    const stopLooking = operations.all.subscribe(look);
    if (stop === null) stop = stopLooking;
    else stopLooking();
  });
}

/** Resolves to the operation as it ended. Raises RestError if the tower refuses to begin it. */
export const commandDrone = (operations: Operations, droneId: number, command: DroneCommand): Promise<Operation> =>
  operations.run('POST', COMMANDS, { path: { drone_id: droneId }, body: command });
