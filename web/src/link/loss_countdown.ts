/**
 * What a drone in the air does while its link, or ours, is lost. No new data arrives then, so this derives it from the
 * last known hold, mode and lost action. It is no more than that, and the text says so.
 */

import { t } from '../languages/text';
import { DOING, dueMs, plainMode } from './hold_view';
import type { FlightValues } from './flight_values';
import type { FlightTask } from './modes';
import type { Drone, HoldView, LostAction } from './wire_types';

/** The last known state. */
export interface LastHeard {
  /** Null: unknown. */
  readonly isAirborne: boolean | null;
  readonly mode: string | null;
  readonly task: FlightTask | null;
  readonly hold: HoldView | null;
  /** `none`: its agent does nothing by itself, because the vehicle is watched only. */
  readonly lostAction: LostAction | 'none';
  readonly lostActionS: number;
}

export function lastHeard(drone: Drone, values: FlightValues, isAirborne: boolean | null): LastHeard {
  return {
    isAirborne,
    mode: values.mode,
    task: values.task,
    hold: drone.hold,
    lostAction: drone.watched_only ? 'none' : drone.lost_action,
    lostActionS: drone.lost_action_s,
  };
}

export interface Silence extends LastHeard {
  /** `own`: this page has no connection to the tower. `drone`: the tower does not hear from the drone. */
  readonly whose: 'own' | 'drone';
  readonly sinceMs: number;
  /** Our clock minus the tower's time of day. */
  readonly towerLagMs: number;
}

export interface Countdown {
  readonly whose: Silence['whose'];
  /** Rounded up; 0 once the time is over. Null without a countdown. */
  readonly secondsLeft: number | null;
  readonly text: string;
}

const IF_ALIVE = t('if its agent is alive');

/** The task of a drone whose lost action is in progress, otherwise that of its mode. */
function taskOf({ hold, task }: LastHeard): FlightTask | null {
  if (hold?.phase === 'asking' || hold?.phase === 'done') {
    if (hold.action === 'return') return 'return';
    if (hold.action === 'land') return 'landing';
  }
  return task;
}

/** "was flying its mission" */
export function wasWords(last: LastHeard): string {
  const { hold, mode } = last;
  const task = taskOf(last);
  if (task === 'return') return t('was returning');
  if (task === 'landing') return t('was landing');
  if (hold?.open) {
    if (hold.stage === 'stay') return t('held in {mode}', { mode: plainMode(hold.mode) });
    return hold.stage === 'altitude' ? t('held its height only') : t('was ordered to hold, not confirmed');
  }
  if (task === 'mission') return t('was flying its mission');
  if (task === 'by-hand') return t('was flown by hand{what}', { what: mode === null ? '' : ` (${mode})` });
  return mode === null ? '' : t('was in {mode}', { mode });
}

/** The action that its agent announced, otherwise the configured one; null: a newer tower has another one. */
function actionOf({ hold, lostAction }: LastHeard): LostAction | null {
  const reported = hold && hold.phase !== 'quiet' && hold.phase !== 'stayed' ? hold.action : null;
  const action = reported ?? lostAction;
  return action !== 'none' && action in DOING ? action : null;
}

/** What the drone and its agent do, with `when` ("in about 11 s"). */
function thenWords(last: LastHeard, when: string): string {
  const task = taskOf(last);
  const goesOn = t('it should go on with that');
  if (task === 'return' || task === 'landing') return goesOn;
  const isOnMission = task === 'mission' && last.hold?.open !== true;
  const isToBeHeld = task === 'by-hand' && last.hold?.open !== true && last.lostAction !== 'none';
  const agent = isToBeHeld
    ? t('it holds, and its agent')
    : isOnMission
      ? t('it goes on with it until its agent')
      : t('its agent');
  const surely = `(${IF_ALIVE})`;
  switch (actionOf(last)) {
    case 'return':
      return isOnMission
        ? t('{agent} returns it {when} {surely}', { agent, when, surely })
        : t('{agent} will return it {when} {surely}', { agent, when, surely });
    case 'land':
      return isOnMission
        ? t('{agent} lands it {when} {surely}', { agent, when, surely })
        : t('{agent} will land it {when} {surely}', { agent, when, surely });
    case 'stay':
      return t('{agent} returns it when the battery is needed for the way home {surely}', { agent, surely });
    case 'continue':
      if (isOnMission) return goesOn;
      return t('{agent} goes on with a mission, or leaves it where it is {surely}', { agent, surely });
    case null:
      return last.lostAction === 'none'
        ? t('what comes next is up to its autopilot')
        : t('this page does not know what its agent will do');
  }
}

function beforeWords(name: string, last: LastHeard, heard = ''): string {
  const airborne = last.isAirborne === null ? `${t('It is not known whether {name} is in the air.', { name })} ` : '';
  const was = wasWords(last);
  return airborne + (was ? `${heard}${name} ${was}` : t('It is not known what {name} was doing', { name }));
}

/** Null if there is nothing to report: the drone was on the ground. */
export function countdown(droneName: string, silence: Silence, nowMs: number): Countdown | null {
  if (silence.isAirborne === false) return null;
  const { whose, sinceMs, lostActionS, hold, towerLagMs } = silence;
  const action = actionOf(silence);
  const task = taskOf(silence);
  const isCounted = (action === 'return' || action === 'land') && task !== 'return' && task !== 'landing';
  const dueAtMs = Math.min(sinceMs + lostActionS * 1000, dueMs(hold, towerLagMs) ?? Infinity);
  // The page's clock ticks in steps, so it may still show a time before the loss.
  const secondsLeft = isCounted ? Math.max(0, Math.ceil((dueAtMs - Math.max(nowMs, sinceMs)) / 1000)) : null;
  const then =
    isCounted && secondsLeft === 0
      ? t('it should be {doing} now ({ifAlive})', { doing: DOING[action], ifAlive: IF_ALIVE })
      : thenWords(silence, t('in about {secondsLeft} s', { secondsLeft }));
  const text =
    whose === 'own'
      ? t('{before}. If it has lost the tower too, {then}.', {
          before: beforeWords(droneName, silence, `${t('At the last contact,')} `),
          then,
        })
      : `${beforeWords(droneName, silence)}; ${then}.`;
  return { whose, secondsLeft, text };
}

/** The same in a few words, for a row of a list: what it does now, and what comes next. */
export function lostBrief(silence: Silence, nowMs: number): { readonly now: string; readonly next: string } {
  const { hold, mode } = silence;
  const task = taskOf(silence);
  if (task === 'return' || task === 'landing')
    return { now: task === 'return' ? t('returning') : t('landing'), next: '' };
  const now = hold?.open
    ? t('holds')
    : task === 'mission'
      ? t('goes on with its mission')
      : task === 'by-hand'
        ? silence.lostAction === 'none'
          ? t('flown by hand')
          : t('flown by hand: holds')
        : mode === null
          ? t('not known what it does')
          : t('was in {mode}', { mode });
  const action = actionOf(silence);
  if (action !== 'return' && action !== 'land') return { now, next: '' };
  const seconds = countdown('', silence, nowMs)?.secondsLeft ?? null;
  const verb = action === 'return' ? t('returns') : t('lands');
  return {
    now,
    next:
      seconds === null ? '' : seconds === 0 ? t('{verb} now', { verb }) : t('{verb} in {seconds} s', { verb, seconds }),
  };
}
