/**
 * Carries out a task at several drones, one after the other: a user who is no admin holds one drone at a time. For each
 * drone: take its controls if they are free, act, give them back. A mission continues without a holder; a drone on the
 * ground stays there. Every drone gets an answer. Independent of any framework and connection: `SquadTower` is its
 * interface to the tower.
 */

import { t } from '../languages/text';
import type { Operation } from '../link/operation_types';
import type { Drone, User } from '../link/wire_types';

export type SquadAnswer = {
  readonly kind: 'waiting' | 'working' | 'done' | 'refused' | 'not-reached';
  /** The current activity, or the outcome, for people. */
  readonly why: string;
  /** Out of `total`; 0: unknown. */
  readonly done: number;
  readonly total: number;
};

export const SQUAD_ANSWER_WORDS: Record<SquadAnswer['kind'], string> = {
  waiting: t('Waits for its turn'),
  working: t('Busy'),
  done: t('Done'),
  refused: t('Not done'),
  'not-reached': t('Not begun'),
};

const answer = (kind: SquadAnswer['kind'], why = '', done = 0, total = 0): SquadAnswer => ({ kind, why, done, total });

export interface SquadTower {
  readonly user: User;
  drone(droneId: number): Drone | undefined;
  /** These reject with errors for people. */
  acquire(droneId: number): Promise<void>;
  release(droneId: number): Promise<void>;
}

/**
 * The steps of one drone. `report`: called with each progress. Resolves to the last operation; rejects with errors for
 * people.
 */
export type SquadAction = (drone: Drone, report: (operation: Operation) => void) => Promise<Operation>;

export interface SquadRun {
  readonly droneIds: readonly number[];
  readonly action: SquadAction;
  /** Time between two drones, so that starts follow the plan. */
  readonly everyS?: number;
  readonly onanswer: (droneId: number, answer: SquadAnswer) => void;
  /** Checked before each drone: whether the user has stopped the run. */
  readonly isStopped?: () => boolean;
  readonly wait?: (seconds: number) => Promise<void>;
  readonly nowMs?: () => number;
  /** After a failure, the remaining drones are not started. */
  readonly stopsAtFailure?: boolean;
}

const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Resolves to the number of successes. */
export async function inTurn(tower: SquadTower, run: SquadRun): Promise<number> {
  const { droneIds, action, onanswer, everyS = 0, isStopped = () => false, stopsAtFailure = false } = run;
  const nowMs = run.nowMs ?? (() => performance.now());
  const wait = run.wait ?? ((seconds) => new Promise((resolve) => setTimeout(resolve, seconds * 1000)));
  for (const droneId of droneIds) onanswer(droneId, answer('waiting'));
  let [done, failed] = [0, ''];
  let last: number | null = null;
  for (const droneId of droneIds) {
    const restS = last === null ? 0 : everyS - (nowMs() - last) / 1000;
    if (restS > 0 && !failed && !isStopped()) await wait(restS);
    if (isStopped() || failed) {
      const why = isStopped()
        ? t('You stopped before its turn.')
        : t('{failed} was not done, so this was not begun.', { failed });
      onanswer(droneId, answer('not-reached', why));
      continue;
    }
    last = nowMs();
    const came = await one(tower, droneId, action, (now) => onanswer(droneId, now));
    onanswer(droneId, came);
    if (came.kind === 'done') done += 1;
    else if (stopsAtFailure) failed = tower.drone(droneId)?.name ?? t('The one before');
  }
  return done;
}

async function one(
  tower: SquadTower,
  droneId: number,
  action: SquadAction,
  report: (answer: SquadAnswer) => void,
): Promise<SquadAnswer> {
  const drone = tower.drone(droneId);
  if (!drone) return answer('refused', t('It is no longer in your squad.'));
  const why = whyNot(drone, tower.user);
  if (why) return answer('refused', why);
  const isOurs = drone.holder?.id === tower.user.id;
  report(answer('working', isOurs ? '' : t('takes control')));
  try {
    if (!isOurs) await tower.acquire(droneId);
  } catch (error) {
    return answer('refused', wordsOf(error));
  }
  const came = await carriedOut(drone, action, report);
  if (isOurs) return came;
  try {
    await tower.release(droneId);
  } catch (error) {
    return answer(
      came.kind,
      t('{why} You still have the controls of {drone}: {wordsOf}', {
        why: came.why,
        drone: drone.name,
        wordsOf: wordsOf(error),
      }).trim(),
    );
  }
  return came;
}

/** Why this drone cannot take part; empty if it can. */
export function whyNot(drone: Drone, user: User): string {
  if (!drone.online) return t('{drone} is offline.', { drone: drone.name });
  if (drone.offered || drone.taken_from)
    return t('The controls of {drone} are between {takenFrom} and an admin.', {
      drone: drone.name,
      takenFrom: drone.taken_from?.name ?? t('its pilot'),
    });
  if (drone.holder && drone.holder.id !== user.id)
    return t('{holder} has the controls of {drone}.', { holder: drone.holder.name, drone: drone.name });
  return '';
}

async function carriedOut(
  drone: Drone,
  action: SquadAction,
  report: (answer: SquadAnswer) => void,
): Promise<SquadAnswer> {
  try {
    const ended = await action(drone, ({ phase, done, total }) => report(answer('working', phase, done, total)));
    if (ended.state === 'done') return answer('done', ended.words, 1, 1);
    return answer('refused', ended.words || t('It ended as "{state}".', { state: ended.state }));
  } catch (error) {
    return answer('refused', wordsOf(error));
  }
}
