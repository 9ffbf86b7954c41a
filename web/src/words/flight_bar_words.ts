/** What the flight bar says of one drone: state, link, battery, in a few words each. Pure. */

import { t } from '../languages/text';
import { BATTERY_CRITICAL_PERCENT, BATTERY_LOW_PERCENT, batteryLevel, type BatteryLevel } from '../link/battery_level';
import type { FlightValues } from '../link/flight_values';
import type { HoldReading } from '../link/hold_view';
import type { LinkReading } from '../link/link_quality';
import { lostBrief, type Silence } from '../link/loss_countdown';
import type { MissionPhase } from '../link/mission_moves';
import { modeSetOf } from '../link/modes';
import type { WayHome } from '../link/way_home';
import type { Drone } from '../link/wire_types';
import { duration, fixed, UNKNOWN } from './format';

export type Tone = '' | 'good' | 'warning' | 'danger';

export interface BarCell {
  readonly text: string;
  readonly detail: string;
  readonly tone: Tone;
}

export interface BarFacts {
  readonly drone: Drone;
  readonly values: FlightValues;
  readonly hold: HoldReading | null;
  readonly silence: Silence | null;
  readonly missionPhase: MissionPhase;
  readonly holdSinceMs: number | null;
  readonly modeSinceMs: number | null;
  /** Why it does what it does, where the pilot did not command it (state_cause.ts); empty: nothing to say. */
  readonly cause: string;
  readonly nowMs: number;
}

/** "0:07", or nothing if it is not known since when. */
const since = (fromMs: number | null, nowMs: number): string =>
  fromMs === null ? '' : ` ${duration(Math.max(0, nowMs - fromMs))}`;
const then = (...parts: readonly string[]): string => parts.filter((part) => part !== '').join('; ');

/** What it does now, and what comes next. */
export function stateCell(facts: BarFacts): BarCell {
  const { drone, values, hold, silence, missionPhase, holdSinceMs, modeSinceMs, cause, nowMs } = facts;
  if (silence && silence.isAirborne !== false) {
    const { now, next } = lostBrief(silence, nowMs);
    const what = silence.whose === 'own' ? t('TOWER LOST') : t('LINK LOST');
    return { text: what + since(silence.sinceMs, nowMs), detail: then(now, next), tone: 'danger' };
  }
  if (silence?.whose === 'own') return { text: t('Tower lost'), detail: t('on the ground'), tone: 'warning' };
  if (!drone.may_watch) return { text: t('View taken'), detail: '', tone: 'warning' };
  if (!drone.online) return { text: t('Offline'), detail: '', tone: '' };
  if (values.state === 'lost') {
    const isKnown = values.heartbeatAgeMs !== null;
    return { text: isKnown ? t('AUTOPILOT SILENT') : t('Not heard yet'), detail: '', tone: isKnown ? 'danger' : '' };
  }
  const isFlying = values.airborne !== false && values.armed !== false;
  if (hold && (drone.hold?.open || hold.phase === 'counting')) {
    const word = drone.hold?.open ? t('HOLD') : (values.mode ?? UNKNOWN);
    return { text: word + since(holdSinceMs, nowMs), detail: then(hold.badge, hold.because), tone: hold.tone };
  }
  const holds = values.autopilot === null ? null : modeSetOf(values.autopilot, values.vehicleType)?.hold;
  if (isFlying && holds && holds.customMode === values.customMode) {
    const next = missionPhase === 'paused' ? t('mission paused, until you fly on') : t('stays here until you fly on');
    return {
      text: t('HOLD{since}', { since: since(modeSinceMs, nowMs) }),
      detail: `${holds.name}: ${next}`,
      tone: 'good',
    };
  }
  if (isFlying && cause) {
    return { text: values.mode ?? UNKNOWN, detail: cause, tone: values.state === 'alert' ? 'danger' : 'warning' };
  }
  const doing = !isFlying
    ? values.armed
      ? t('motors running, on the ground')
      : t('on the ground')
    : missionPhase === 'paused'
      ? t('mission paused')
      : missionPhase === 'flown'
        ? t('flies its mission')
        : hold
          ? then(hold.badge, hold.because)
          : '';
  return { text: values.mode ?? UNKNOWN, detail: doing, tone: values.state === 'alert' ? 'danger' : '' };
}

/** Below this, an age is the rhythm of the telemetry and no news. */
const FRESH_MS = 2_500;

export function linkCell(values: FlightValues, link: LinkReading | null, isDeaf: boolean): BarCell {
  const ages = [values.positionAgeMs, values.heartbeatAgeMs].filter((age) => age !== null);
  if (ages.length === 0) return { text: UNKNOWN, detail: t('not heard yet'), tone: '' };
  const ageMs = Math.min(...ages);
  const loss = link?.over30s.lossUpPercent ?? values.linkLossPercent;
  const detail = t('{loss} % lost', { loss: fixed(loss) });
  const isOld = isDeaf || ageMs > FRESH_MS;
  if (isOld)
    return {
      text: t('{age} s old', { age: fixed(ageMs / 1000) }),
      detail: isDeaf ? t('no tower') : detail,
      tone: 'danger',
    };
  const tone = link?.grade === 'bad' ? 'danger' : link?.grade === 'poor' ? 'warning' : '';
  return { text: `${fixed(values.linkRttMs)} ms`, detail, tone };
}

const LEVEL_WORDS: Record<BatteryLevel, string> = { low: t('low'), critical: t('critical') };
const PERCENT_OF: Record<BatteryLevel, number> = { low: BATTERY_LOW_PERCENT, critical: BATTERY_CRITICAL_PERCENT };

/** Less than this after the way home wants a decision. */
const SHORT_MS = 60_000;

export function batteryCell(values: FlightValues, home: WayHome): BarCell {
  const level = batteryLevel(values);
  const text = `${fixed(values.batteryPercent)} %`;
  const after = home.afterMs;
  // The autopilot judges by the voltage, this estimate by the charge that was drawn: only one of them can be said.
  const isByVoltage =
    level !== null &&
    values.batteryPercent !== null &&
    values.batteryPercent > PERCENT_OF[level] &&
    !(after !== null && after < 0);
  if (isByVoltage && values.batteryV !== null) {
    return {
      text: `${fixed(values.batteryV, 1)} V ${LEVEL_WORDS[level]}`,
      detail: t('its gauge says {percent}', { percent: text }),
      tone: level === 'low' ? 'warning' : 'danger',
    };
  }
  const detail =
    after === null
      ? values.airborne === false
        ? `${fixed(values.batteryV, 1)} V`
        : t('left at home: unknown')
      : after < 0
        ? t('NOT enough for home')
        : t('{after} left at home', { after: duration(after) });
  const isShort = after !== null && after < SHORT_MS;
  const tone = level === 'critical' || (after !== null && after < 0) ? 'danger' : level || isShort ? 'warning' : '';
  const word = level === null ? '' : ` ${LEVEL_WORDS[level]}`;
  return { text: text + word, detail, tone };
}
