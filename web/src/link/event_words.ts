/** The tower's events in words for people. */

import { t } from '../languages/text';
import type { ControlEvent, HoldEvent } from './wire_types';

export function controlWords({ event, holder, by, reason }: ControlEvent, drone: string): string {
  const who = by?.name ?? t('The tower');
  const why = reason ? `: ${reason}` : '';
  const now = holder ? t('{holder} has the controls', { holder: holder.name }) : t('nobody has the controls');
  switch (event) {
    case 'acquired':
      return t('{who} took control of {drone}', { who, drone });
    case 'released':
      return t('{who} released the controls of {drone}', { who, drone });
    case 'taken':
      return t('{who} TOOK control of {drone}{why}', { who, drone, why });
    case 'given':
      return t('{who} gives back the controls of {drone}{why}', { who, drone, why });
    case 'accepted':
      return t('{who} accepted the controls of {drone}: "I have control"', { who, drone });
    case 'assisting':
      return t('{who} assists with {drone}, {now}{why}', { who, drone, now, why });
    case 'assist_ended':
      return t('The assistance with {drone} has ended, {now}{why}', { drone, now, why });
    case 'revoked':
      return t('The controls of {drone} were revoked by {who}{why}', { drone, who, why });
    case 'expired':
      return t('The controls of {drone} expired{why}; {now}', { drone, why, now });
    default:
      return t('The controls of {drone} changed ({event}), {now}{why}', { drone, event, now, why });
  }
}

const CAUSE_WORDS: Record<string, string> = {
  order: t('ordered by the tower'),
  'pilot-lost': t('the pilot or the tower was lost'),
  'sticks-stale': t('the sticks stopped or came too late'),
};

/** Why a drone holds. `reason`: of an order, as the tower said it. */
export const causeWords = (cause: string, reason = ''): string => {
  const words = CAUSE_WORDS[cause] ?? cause;
  return cause === 'order' && reason !== '' ? `${words}: ${reason.replace(/\.$/, '')}` : words;
};

/** The reason of an order to hold, from the event that announces it; empty in others. */
export const orderReason = ({ step, detail, cause }: HoldEvent): string =>
  step === 'ordered' && (cause ?? 'order') === 'order' ? detail : '';

const STEP_WORDS: Record<string, string> = {
  ordered: t('ordered'),
  sticks_centred: t('sticks centred'),
  mode_requested: t('mode requested'),
  mode_acknowledged: t('mode acknowledged'),
  confirmed: t('confirmed by the autopilot'),
  not_needed: t('not needed'),
  unconfirmed: t('NOT CONFIRMED'),
};

export const stepWords = (step: string): string => STEP_WORDS[step] ?? step;

export function holdWords({ step, detail, elapsed_ms: elapsedMs, cause }: HoldEvent): string {
  const why = cause && cause !== 'order' ? ` (${causeWords(cause)})` : '';
  return t('Hold {step} after {elapsed} ms{why}{what}', {
    step: stepWords(step),
    elapsed: Math.round(elapsedMs),
    why,
    what: detail ? `: ${detail}` : '',
  });
}

/** The message for a user whom the tower signed out. A drone flown by hand holds; autonomous flight continues. */
export function farewellWords(why: string, flown: readonly string[]): string {
  const ended = why ? t('You were signed out: {why}.', { why: why.replace(/\.$/, '') }) : t('You were signed out.');
  if (flown.length === 0) return ended;
  const names = flown.join(', ');
  return t('{ended} You have lost the controls of {names}. A drone that was in the air holds.', { ended, names });
}

/** `said`: what the tower tells of a rehearsed loss. */
export const rehearsalWords = (said: string): string => t('Rehearsal: {event}', { event: said });
