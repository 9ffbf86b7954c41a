/** The outcome of a command, and its text. */

import { t } from '../languages/text';
import { MAV_RESULT } from './generated/mavlink.gen';

/** What the tower could not determine: whether the drone received the command, or whether it complies. */
export type Doubt = 'no-answer' | 'unconfirmed';

export type Outcome =
  | { readonly kind: 'accepted' }
  | { readonly kind: 'refused'; readonly result: number }
  | { readonly kind: 'no-answer' }
  /** Accepted, but the HEARTBEAT never agreed. */
  | { readonly kind: 'unconfirmed'; readonly detail: string }
  /** Not sent, or nobody knows whether it was carried out; `why` says which. */
  | { readonly kind: 'failed'; readonly why: string }
  /**
   * Through the tower: the tower or the agent reported the outcome, in a whole sentence. `problem`: the name in
   * docs/api.md of why the tower refused it.
   */
  | {
      readonly kind: 'reported';
      readonly isDone: boolean;
      readonly words: string;
      readonly doubt?: Doubt;
      readonly problem?: string;
    };

export const isGood = (outcome: Outcome): boolean =>
  outcome.kind === 'accepted' || (outcome.kind === 'reported' && outcome.isDone);

export const REPLACED: Outcome = { kind: 'failed', why: t('a newer command replaced it') };

const MAV_RESULT_CANCELLED = 6;
const MAV_RESULT_UNSUPPORTED_FRAME = 9;
const MAV_RESULT_NOT_IN_CONTROL = 10;

const RESULT_WORDS: Record<number, string> = {
  [MAV_RESULT.TEMPORARILY_REJECTED]: t('cannot do it now (temporarily rejected)'),
  [MAV_RESULT.DENIED]: t('denied it'),
  [MAV_RESULT.UNSUPPORTED]: t('does not know this command'),
  [MAV_RESULT.FAILED]: t('could not do it (failed)'),
  [MAV_RESULT_CANCELLED]: t('cancelled it'),
  [MAV_RESULT.COMMAND_LONG_ONLY]: t('accepts this command as COMMAND_LONG only'),
  [MAV_RESULT.COMMAND_INT_ONLY]: t('accepts this command as COMMAND_INT only'),
  [MAV_RESULT_UNSUPPORTED_FRAME]: t('does not know this coordinate frame'),
  [MAV_RESULT_NOT_IN_CONTROL]: t('reports that we are not in control'),
};

export function outcomeWords(droneName: string, outcome: Outcome): string {
  switch (outcome.kind) {
    case 'accepted':
      return t('{droneName} accepted it', { droneName });
    case 'refused':
      return `${droneName} ${RESULT_WORDS[outcome.result] ?? t('refused it (result {result})', { result: outcome.result })}`;
    case 'no-answer':
      return t('{droneName} did not answer. Watch what it does before you try again', { droneName });
    case 'unconfirmed':
      return t('{droneName} accepted it, but {detail}', { droneName, detail: outcome.detail });
    case 'failed':
      return `${droneName}: ${outcome.why}`;
    case 'reported':
      return outcome.words;
  }
}
