/** A key of the person, for the replay on view. */

import { isTyping } from '../is_typing';
import { nextSpeed, replayKey } from './replay_keys';
import type { ReplaySession } from './replay_session.svelte';

export function pressed(event: KeyboardEvent, session: ReplaySession): void {
  if (isTyping(event) && !isScrub(event.target)) return;
  if (event.target instanceof HTMLElement && event.target.closest('.maplibregl-map')) return;
  const wanted = replayKey(event);
  // A button that has the focus is pressed with the space bar.
  if (!wanted || (wanted.do === 'toggle' && event.target instanceof HTMLButtonElement)) return;
  event.preventDefault();
  const { player } = session;
  const { speed } = player.state.get();
  if (wanted.do === 'toggle') player.toggle();
  else if (wanted.do === 'by') player.seek(player.headedMs + wanted.ms);
  else if (wanted.do === 'to') player.seek(wanted.end === 'begin' ? -Infinity : Infinity);
  else if (wanted.do === 'event') session.jump(wanted.way);
  else player.setSpeed(nextSpeed(speed, wanted.way));
}

const isScrub = (target: EventTarget | null): boolean => target instanceof HTMLInputElement && target.type === 'range';
