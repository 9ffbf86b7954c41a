/**
 * What a drone can be told through the tower (`POST /drones/{id}/commands`), each an operation with an answer in words.
 * Heights are metres above home.
 */

import type { Outcome } from './commands';
import type { Operation } from './operation_types';
import { isOver, type Operations } from './operations';

export type DroneCommand =
  | { readonly command: 'arm' | 'land' | 'rtl' | 'hold' | 'pause' | 'resume' }
  | { readonly command: 'disarm'; readonly force?: boolean }
  | { readonly command: 'mode'; readonly mode: string }
  | { readonly command: 'takeoff'; readonly height_m: number }
  | {
      readonly command: 'goto';
      readonly lat: number;
      readonly lon: number;
      readonly height_m: number;
      readonly speed_m_s?: number;
    }
  | {
      readonly command: 'set_home';
      readonly lat: number;
      readonly lon: number;
      readonly altitude_m: number;
      readonly while_flying?: boolean;
    }
  | { readonly command: 'set_home'; readonly here: true; readonly while_flying?: boolean }
  | { readonly command: 'speed'; readonly m_s: number }
  | { readonly command: 'yaw'; readonly deg: number; readonly relative?: boolean }
  /** Items count from 0, as in the plan. */
  | { readonly command: 'start'; readonly item?: number }
  | { readonly command: 'jump'; readonly item: number }
  | {
      readonly command: 'orbit';
      readonly lat: number;
      readonly lon: number;
      /** Negative: counter-clockwise. */
      readonly radius_m: number;
      readonly height_m: number;
      readonly m_s?: number;
    }
  | { readonly command: 'roi'; readonly lat: number; readonly lon: number; readonly height_m: number }
  | { readonly command: 'roi'; readonly none: true }
  | FollowCommand
  | FollowMeCommand;

/** Keeps this place relative to another drone: it runs until something ends it, and then the drone holds. */
export interface FollowCommand {
  readonly command: 'follow';
  readonly leader: number;
  readonly north_m: number;
  readonly east_m: number;
  readonly up_m: number;
  readonly for_s: number;
}

/** Where the person is; from then on the live channel tells it. */
export interface FollowMeCommand {
  readonly command: 'follow_me';
  readonly lat: number;
  readonly lon: number;
  readonly accuracy_m: number;
  readonly age_ms: number;
  readonly distance_m: number;
  readonly for_s: number;
}

/** The same as what became of it, in words. */
export async function outcomeOfCommand(
  operations: Operations,
  droneId: number,
  command: DroneCommand,
): Promise<Outcome> {
  try {
    const { state, words } = await commandDrone(operations, droneId, command);
    return { kind: 'told', isDone: state === 'done', words: words || 'The tower has not said how it ended.' };
  } catch (error) {
    return { kind: 'told', isDone: false, words: error instanceof Error ? error.message : String(error) };
  }
}

/** Answers with the operation as it begins: it ends when the drone follows no more. Raises RestError when it is refused. */
export const followLeader = (operations: Operations, droneId: number, command: FollowCommand): Promise<Operation> =>
  operations.start('POST', `/drones/${droneId}/commands`, command);

/** The same. */
export const followPerson = (operations: Operations, droneId: number, command: FollowMeCommand): Promise<Operation> =>
  operations.start('POST', `/drones/${droneId}/commands`, command);

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
  operations.run('POST', `/drones/${droneId}/commands`, command);
