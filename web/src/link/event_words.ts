/** The tower's events in words for people. */

import type { ControlEvent, HoldEvent } from './wire_types';

export function controlWords({ event, holder, by, reason }: ControlEvent, drone: string): string {
  const who = by?.name ?? 'The tower';
  const why = reason ? `: ${reason}` : '';
  const now = holder ? `${holder.name} has the controls` : 'nobody has the controls';
  switch (event) {
    case 'acquired':
      return `${who} took up the controls of ${drone}`;
    case 'released':
      return `${who} released the controls of ${drone}`;
    case 'taken':
      return `${who} TOOK the controls of ${drone}${why}`;
    case 'given':
      return `${who} gives back the controls of ${drone}${why}`;
    case 'accepted':
      return `${who} accepted the controls of ${drone}: "I have control"`;
    case 'assisting':
      return `${who} assists with ${drone}, ${now}${why}`;
    case 'assist_ended':
      return `The assistance with ${drone} has ended, ${now}${why}`;
    case 'revoked':
      return `The controls of ${drone} were revoked by ${who}${why}`;
    case 'expired':
      return `The controls of ${drone} expired${why}; ${now}`;
    default:
      return `The controls of ${drone} changed (${event}), ${now}${why}`;
  }
}

const CAUSE_WORDS: Record<string, string> = {
  order: 'ordered by the tower',
  'pilot-lost': 'the pilot or the tower was lost',
  'sticks-stale': 'the sticks stopped or came too late',
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
  ordered: 'ordered',
  sticks_centred: 'sticks centred',
  mode_requested: 'mode requested',
  mode_acknowledged: 'mode acknowledged',
  confirmed: 'confirmed by the autopilot',
  not_needed: 'not needed',
  unconfirmed: 'NOT CONFIRMED',
};

export const stepWords = (step: string): string => STEP_WORDS[step] ?? step;

export function holdWords({ step, detail, elapsed_ms: elapsedMs, cause }: HoldEvent): string {
  const why = cause && cause !== 'order' ? ` (${causeWords(cause)})` : '';
  return `Hold ${stepWords(step)} after ${Math.round(elapsedMs)} ms${why}${detail ? `: ${detail}` : ''}`;
}

/** The message for a user whom the tower signed out. A drone flown by hand holds; autonomous flight continues. */
export function farewellWords(why: string, flown: readonly string[]): string {
  const ended = why ? `You were signed out: ${why.replace(/\.$/, '')}.` : 'You were signed out.';
  if (flown.length === 0) return ended;
  const names = flown.join(', ');
  return `${ended} You have lost the controls of ${names}. A drone that was in the air holds.`;
}
