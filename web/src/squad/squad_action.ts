/**
 * One action for several drones: which drones this user may command, and the outcome of each. An operator commands
 * drones that they hold; an admin may first take drones from others. Every drone gets an answer.
 */

import { t } from '../languages/text';
import { outcomeWords, type Outcome } from '../link/outcome';
import type { ControlAction } from '../link/rest';
import type { Drone, User } from '../link/wire_types';

export type SquadAction = 'hold' | 'return' | 'land';

export const ACTION_WORDS: Record<SquadAction, { readonly verb: string; readonly does: string }> = {
  hold: { verb: t('Hold'), does: t('stops and stays where it is') },
  return: { verb: t('Return'), does: t('flies back to its home and lands there') },
  land: { verb: t('Land'), does: t('lands where it is now') },
};

export type Answer =
  | { readonly kind: 'waiting'; readonly why: string }
  | { readonly kind: 'done'; readonly why: string }
  | { readonly kind: 'refused'; readonly why: string }
  /** Accepted, but without evidence that the drone complies. */
  | { readonly kind: 'unconfirmed'; readonly why: string }
  | { readonly kind: 'no-answer'; readonly why: string };

export const ANSWER_WORDS: Record<Answer['kind'], string> = {
  waiting: t('Waiting'),
  done: t('Done'),
  refused: t('Refused'),
  unconfirmed: t('Not confirmed'),
  'no-answer': t('No answer'),
};

/** How this user gets the controls of a drone that they cannot command, or null if they cannot. */
export function wayToControls(drone: Drone, user: User): ControlAction | null {
  if (user.role !== 'admin' || !drone.online) return null;
  if (drone.holder === null) return 'acquire';
  return drone.holder.id === user.id ? null : 'take';
}

export function answerOf(droneName: string, outcome: Outcome): Answer {
  const why = outcomeWords(droneName, outcome);
  switch (outcome.kind) {
    case 'accepted':
      return { kind: 'done', why };
    case 'no-answer':
    case 'unconfirmed':
      return { kind: outcome.kind, why };
    case 'reported':
      return { kind: outcome.doubt ?? (outcome.isDone ? 'done' : 'refused'), why };
    case 'refused':
    case 'failed':
      return { kind: 'refused', why };
  }
}
