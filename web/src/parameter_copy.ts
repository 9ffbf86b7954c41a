/** Writes some of one drone's parameters to other drones, each if the user may, each with its own result. */

import { t } from './languages/text';
import type { Operation } from './link/operation_types';
import { mayCommand, mayHaveControls } from './link/drone_view';
import type { ParameterTables } from './link/parameter_tables';
import type { Drone, User } from './link/wire_types';
import { wordsOf } from './loading.svelte';
import { compared, type Difference } from './parameters/differences';
import { tableOf } from './parameters/kinds';

export interface CopyPlan {
  readonly drone: Drone;
  readonly differences: readonly Difference[];
  readonly same: number;
  /** Names that the drone does not have. */
  readonly unknown: readonly string[];
}

export type CopyAnswer =
  { readonly kind: 'waiting'; readonly words: string } | { readonly kind: 'done' | 'refused'; readonly words: string };

/** How this user may write there: at once, by taking free controls, or not at all (then with the reason). */
export function wayToWrite(drone: Drone, user: User): 'now' | 'acquire' | { readonly why: string } {
  if (!drone.online) return { why: t('{drone} is offline.', { drone: drone.name }) };
  if (mayCommand(drone, user)) return 'now';
  if (drone.holder)
    return { why: t('{holder} has the controls of {drone}.', { holder: drone.holder.name, drone: drone.name }) };
  if (drone.taken_from?.id === user.id)
    return { why: t('The controls of {drone} were taken from you.', { drone: drone.name }) };
  return mayHaveControls(drone, user) ? 'acquire' : { why: t('{drone} is not yours to fly.', { drone: drone.name }) };
}

/** Raises RestError if its parameters are unknown. */
export async function planCopy(
  tables: ParameterTables,
  drone: Drone,
  values: ReadonlyMap<string, number>,
): Promise<CopyPlan> {
  const { differences, same, unknownHere } = compared(tableOf((await tables.read(drone.id)).values), values);
  return { drone, differences, same, unknown: unknownHere };
}

export interface Hands {
  acquire(droneId: number): Promise<void>;
  release(droneId: number): Promise<void>;
  /** Resolves when it has ended. */
  write(droneId: number, values: Readonly<Record<string, number>>): Promise<Operation>;
}

/** Writes what differs. Controls taken for this are released afterwards, whatever the result. */
export async function copyTo(plan: CopyPlan, user: User, hands: Hands): Promise<CopyAnswer> {
  const { drone, differences } = plan;
  if (differences.length === 0) return { kind: 'done', words: t('already had all of them') };
  const way = wayToWrite(drone, user);
  if (typeof way === 'object') return { kind: 'refused', words: way.why };
  let isOurs = false;
  try {
    if (way === 'acquire') {
      await hands.acquire(drone.id);
      isOurs = true;
    }
    const values = Object.fromEntries(differences.map(({ name, there }) => [name, there]));
    const { state, words, refusals } = await hands.write(drone.id, values);
    const listed = refusals.map((one) => `${one.name}: ${one.words}`);
    return { kind: state === 'done' ? 'done' : 'refused', words: [words, ...listed].join(' ') };
  } catch (error) {
    return { kind: 'refused', words: wordsOf(error) };
  } finally {
    if (isOurs) await hands.release(drone.id).catch(() => undefined);
  }
}
