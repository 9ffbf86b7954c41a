/** What a drone in the air does while its link, or ours, is lost: known beforehand, because nobody can tell us then. */

import type { LostAction } from './wire_types';

export interface Silence {
  /** `own`: this page has no connection to the tower. `drone`: the tower does not hear the drone. */
  readonly whose: 'own' | 'drone';
  readonly sinceMs: number;
  /** As last known. */
  readonly isAirborne: boolean;
  readonly lostAction: LostAction;
  readonly lostActionS: number;
}

export interface Countdown {
  readonly whose: Silence['whose'];
  /** Rounded up; 0 once the time is over. */
  readonly secondsLeft: number;
  readonly text: string;
}

const WILL: Record<LostAction, string> = {
  return: 'return',
  land: 'land',
  continue: 'go on with its mission',
  nothing: 'do what its autopilot is set to',
};
const SHOULD_BE: Record<LostAction, string> = {
  return: 'returning',
  land: 'landing',
  continue: 'going on with its mission',
  nothing: 'doing what its autopilot is set to',
};

/** Null when there is nothing to count down: it was on the ground. */
export function countdown(droneName: string, silence: Silence, nowMs: number): Countdown | null {
  if (!silence.isAirborne) return null;
  const action: LostAction = silence.lostAction in WILL ? silence.lostAction : 'nothing';
  // The page's clock ticks now and then, so it may still show a time before the loss.
  const elapsedMs = Math.max(0, nowMs - silence.sinceMs);
  const leftMs = silence.lostActionS * 1000 - elapsedMs;
  const secondsLeft = Math.max(0, Math.ceil(leftMs / 1000));
  // With our own connection gone we cannot know whether the drone has lost the tower too.
  const condition = silence.whose === 'own' ? 'If the tower is lost to it as well and' : 'If';
  const text =
    secondsLeft > 0
      ? `${droneName} holds. ${condition} the link does not come back it will ${WILL[action]} in ${secondsLeft} s.`
      : silence.whose === 'own'
        ? `${droneName} should now be ${SHOULD_BE[action]} if the tower is lost to it as well; otherwise it holds.`
        : `${droneName} should now be ${SHOULD_BE[action]}.`;
  return { whose: silence.whose, secondsLeft, text };
}
