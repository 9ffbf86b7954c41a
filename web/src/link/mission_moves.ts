/**
 * When the mission on board can be started, paused, resumed, or sent to another item: one table for every page that has
 * these buttons. Pure.
 */

import { t } from '../languages/text';
import type { FlightTask } from './modes';

/** MISSION_STATE. */
const PAUSED = 4;

export type MissionPhase =
  | 'unknown'
  | 'none'
  /** On the ground. */
  | 'ready'
  | 'flown'
  | 'paused'
  /** In the air, doing something else. */
  | 'elsewhere';
export type MissionMove = 'start' | 'pause' | 'resume' | 'jump';

export interface MissionFacts {
  /** Items of the mission on board; null: unknown. */
  readonly count: number | null;
  /** Null: unknown, which counts as in the air. */
  readonly airborne: boolean | null;
  /** Its mode flies the mission, paused or not. */
  readonly isFlown: boolean;
  readonly task: FlightTask | null;
  /** MISSION_CURRENT.mission_state; 0 or null: not reported. */
  readonly missionState: number | null;
  /** The drone accepted a pause, and nothing has resumed the mission since. */
  readonly wasPaused: boolean;
}

export function missionPhase(facts: MissionFacts): MissionPhase {
  const { count, airborne, isFlown, task, missionState, wasPaused } = facts;
  if (count === null) return 'unknown';
  if (count === 0) return 'none';
  if (airborne === false) return isFlown ? 'flown' : 'ready';
  if (isFlown) return missionState === PAUSED ? 'paused' : 'flown';
  const goesHome = task === 'return' || task === 'landing';
  return !goesHome && (missionState === PAUSED || wasPaused) ? 'paused' : 'elsewhere';
}

const NOTHING = t('No mission is on board.');
const NOT_KNOWN = t('It is not known what is on board.');
const FLIES = t('It flies its mission: pause it first.');
const PAUSES = t('It is paused already.');
const NO_MISSION = t('It flies no mission now.');
const GROUND = t('It is on the ground: start the mission.');

/** Why a move is not possible; empty: it is. */
const WHY_NOT: Record<MissionPhase, Record<MissionMove, string>> = {
  unknown: { start: NOT_KNOWN, pause: '', resume: NOT_KNOWN, jump: NOT_KNOWN },
  none: { start: NOTHING, pause: NOTHING, resume: NOTHING, jump: NOTHING },
  ready: { start: '', pause: GROUND, resume: GROUND, jump: GROUND },
  flown: { start: FLIES, pause: '', resume: t('It flies its mission.'), jump: '' },
  paused: { start: '', pause: PAUSES, resume: '', jump: '' },
  elsewhere: { start: '', pause: NO_MISSION, resume: '', jump: '' },
};

const UNFIT = t('The mission on board may be incomplete: upload it again.');

export function whyNotMove(move: MissionMove, phase: MissionPhase, isUnfit = false): string {
  return WHY_NOT[phase][move] || (isUnfit && move !== 'pause' ? UNFIT : '');
}
