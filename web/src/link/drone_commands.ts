/**
 * What a drone can be told through the tower (`POST /drones/{id}/commands`), each an operation with an answer in words.
 * Heights are metres above home.
 */

import type { Outcome } from './outcome';
import type { Operation } from './operation_types';
import { isOver, type Operations } from './operations';
import type { BodyOf, Schemas } from './rest_types';

export type DroneCommand = BodyOf<'POST', typeof COMMANDS>;
/** Keeps this place relative to another drone: it runs until something ends it, and then the drone holds. */
export type FollowCommand = Schemas['Follow'];
/** Where the person is; from then on the live channel tells it. */
export type FollowMeCommand = Schemas['FollowMe'];

const COMMANDS = '/drones/{drone_id}/commands';

function outcomeOf({ state, seen, words: said }: Operation): Outcome {
  const words = said || 'The tower did not report the result.';
  const isDone = state === 'done';
  if (state === 'timed_out') return { kind: 'reported', isDone, words, doubt: 'no-answer' };
  return { kind: 'reported', isDone, words, ...(isDone && seen === false ? { doubt: 'unconfirmed' } : {}) };
}

/** The same as what became of it, in words. */
export async function outcomeOfCommand(
  operations: Operations,
  droneId: number,
  command: DroneCommand,
): Promise<Outcome> {
  try {
    return outcomeOf(await commandDrone(operations, droneId, command));
  } catch (error) {
    return { kind: 'reported', isDone: false, words: error instanceof Error ? error.message : String(error) };
  }
}

/** Answers with the operation as it begins: it ends when the drone follows no more. Raises RestError when it is refused. */
export const followLeader = (operations: Operations, droneId: number, command: FollowCommand): Promise<Operation> =>
  operations.start('POST', COMMANDS, { path: { drone_id: droneId }, body: command });

/** The same. */
export const followPerson = (operations: Operations, droneId: number, command: FollowMeCommand): Promise<Operation> =>
  operations.start('POST', COMMANDS, { path: { drone_id: droneId }, body: command });

/** Answers with the operation as soon as the drone follows, or when it has ended before. */
export function followsOrEnded(operations: Operations, id: string): Promise<Operation | null> {
  return new Promise((resolve) => {
    let stop: (() => void) | null = null;
    const look = (all: ReadonlyMap<string, Operation>): void => {
      const one = all.get(id) ?? null;
      // The agent tells for how long once it follows, not before.
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

/** Answers with the operation as it ended. Raises RestError when the tower refuses to begin it. */
export const commandDrone = (operations: Operations, droneId: number, command: DroneCommand): Promise<Operation> =>
  operations.run('POST', COMMANDS, { path: { drone_id: droneId }, body: command });
