/**
 * Sends drones to their places at a leader, one after the other: the next starts when the one before is in place. A
 * drone follows only while it has a holder, so controls taken for this are kept. Independent of any framework;
 * `FormationTower` is its interface to the tower.
 */

import { t } from '../languages/text';
import { isOver } from '../link/operations';
import type { Operation } from '../link/operation_types';
import { whyNot, type SquadTower } from './squad_flight';
import type { FollowPlace } from './follow_place';

export type FormationState = 'waiting' | 'going' | 'following' | 'ended' | 'refused' | 'not-reached';

export interface FormationAnswer {
  readonly state: FormationState;
  readonly why: string;
  readonly operationId: string | null;
}

export const FORMATION_WORDS: Record<FormationState, string> = {
  waiting: t('Waits for its turn'),
  going: t('Flies to its place'),
  following: t('Follows'),
  ended: t('No longer follows'),
  refused: t('Does not follow'),
  'not-reached': t('Not begun'),
};

export interface FormationTower extends Omit<SquadTower, 'release'> {
  /** Begins it. Rejects with errors for people. */
  follow(droneId: number, place: FollowPlace): Promise<Operation>;
  /** Reports each change from now on, until it is over. */
  watch(operationId: string, heard: (operation: Operation) => void): void;
  /** Metres from its place; null: unknown. */
  offPlaceM(droneId: number, place: FollowPlace): number | null;
  /** Waits a moment. */
  wait(): Promise<void>;
  nowMs(): number;
}

export interface FormationRun {
  readonly ways: readonly { readonly droneId: number; readonly place: FollowPlace }[];
  readonly isStopped: () => boolean;
  readonly onanswer: (droneId: number, answer: FormationAnswer) => void;
}

/** Within this distance of its place, the drone counts as there. */
export const THERE_M = 5;
/** A drone that is not there by then is in the way of the others. */
export const THERE_WITHIN_MS = 90_000;

const answer = (state: FormationState, why = '', operationId: string | null = null): FormationAnswer => ({
  state,
  why,
  operationId,
});
const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** The text for a follow operation. The agent reports a duration only once it follows. */
export function followAnswer(operation: Operation, isThere: boolean): FormationAnswer {
  const { id, state, words, phase, total } = operation;
  if (!isOver(operation)) return answer(total > 0 && isThere ? 'following' : 'going', phase, id);
  return answer(state === 'refused' ? 'refused' : 'ended', words || t('It ended as "{state}".', { state }), id);
}

export async function formUp(tower: FormationTower, { ways, isStopped, onanswer }: FormationRun): Promise<void> {
  for (const { droneId } of ways) onanswer(droneId, answer('waiting'));
  let failed = '';
  for (const { droneId, place } of ways) {
    if (isStopped() || failed !== '') {
      onanswer(droneId, answer('not-reached', isStopped() ? t('You stopped before its turn.') : failed));
      continue;
    }
    const name = tower.drone(droneId)?.name ?? t('The one before');
    const why = await sendOff(tower, droneId, place, isStopped, (now) => onanswer(droneId, now));
    if (why !== '') failed = t('{name} {why}, so this one was not sent.', { name, why });
  }
}

/** Until it is in its place. Resolves to the reason why not; empty if it is. */
async function sendOff(
  tower: FormationTower,
  droneId: number,
  place: FollowPlace,
  isStopped: () => boolean,
  report: (answer: FormationAnswer) => void,
): Promise<string> {
  const drone = tower.drone(droneId);
  const cannot = drone ? whyNot(drone, tower.user) : t('It is no longer in your squad.');
  if (cannot) {
    report(answer('refused', cannot));
    return t('does not follow');
  }
  report(answer('going', t('takes control')));
  let newest: Operation;
  try {
    if (drone!.holder?.id !== tower.user.id) await tower.acquire(droneId);
    if (isStopped()) {
      report(answer('not-reached', t('You stopped before it was sent.')));
      return '';
    }
    newest = await tower.follow(droneId, place);
  } catch (error) {
    report(answer('refused', wordsOf(error)));
    return t('does not follow');
  }
  let isThere = false;
  const put = (operation: Operation): void => {
    newest = operation;
    report(followAnswer(operation, isThere));
  };
  put(newest);
  tower.watch(newest.id, put);
  const until = tower.nowMs() + THERE_WITHIN_MS;
  while (!isOver(newest) && !isStopped()) {
    const offM = tower.offPlaceM(droneId, place);
    isThere = newest.total > 0 && offM !== null && offM < THERE_M;
    if (isThere) {
      put(newest);
      return '';
    }
    if (tower.nowMs() > until) return t('is not in its place');
    await tower.wait();
  }
  return isOver(newest) ? t('does not follow') : '';
}
