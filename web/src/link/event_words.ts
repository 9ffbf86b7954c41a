/** What the tower's events mean, in words for people. */

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
      return `${who} gave back the controls of ${drone}, ${now}${why}`;
    case 'revoked':
      return `The controls of ${drone} were revoked by ${who}${why}`;
    case 'expired':
      return `The controls of ${drone} expired${why}; ${now}`;
  }
}

const STEP_WORDS: Record<string, string> = {
  ordered: 'ordered',
  sticks_centred: 'sticks centred',
  mode_requested: 'mode requested',
  mode_acknowledged: 'mode acknowledged',
  confirmed: 'confirmed by the autopilot',
  not_needed: 'not needed',
  unconfirmed: 'NOT CONFIRMED',
};

export function holdWords({ step, detail, elapsed_ms: elapsedMs }: HoldEvent): string {
  const words = STEP_WORDS[step] ?? step;
  return `Hold ${words} after ${Math.round(elapsedMs)} ms${detail ? `: ${detail}` : ''}`;
}
