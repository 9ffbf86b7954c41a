/**
 * How long the battery lasts after the way home: the time in the air that a pilot still has to give away. Cautious, from
 * the telemetry alone, and unknown where the telemetry does not tell. Pure.
 */

import { t } from '../languages/text';
import type { BatteryTime } from './battery_time';
import { bearingDeg } from './geometry';
import type { Place } from './messages';

/** Slower than this is hovering, which says nothing about the way home. */
export const MOVING_MPS = 3;
export const USUAL_MPS = 5;
/** Against a wind as fast as the drone nobody comes home; the estimate then becomes "not enough" and not infinite. */
const SLOWEST_MPS = 0.5;
/** As ArduCopter comes down: fast at first, slowly over the last 10 m. */
const DOWN_MPS = 1.5;
const LANDING_MPS = 0.5;
const LANDING_BELOW_M = 10;
const MAX_AGE_MS = 10_000;

export interface WayHomeFacts {
  readonly airborne: boolean | null;
  readonly batteryTime: BatteryTime | null;
  readonly place: Place | null;
  readonly home: Place | null;
  readonly homeDistanceM: number | null;
  readonly altRelM: number | null;
  readonly groundSpeedMps: number | null;
  readonly wind: { readonly fromDeg: number; readonly mps: number } | null;
  readonly positionAgeMs: number | null;
  readonly batteryAgeMs: number | null;
}

export type WayHome =
  /** Negative: the battery does not last for the way home. */
  { readonly afterMs: number; readonly wayMs: number } | { readonly afterMs: null; readonly why: string };

const unknown = (why: string): WayHome => ({ afterMs: null, why });

export function afterWayHome(facts: WayHomeFacts): WayHome {
  if (facts.airborne === false) return unknown(t('on the ground'));
  if (facts.airborne === null) return unknown(t('not known whether it flies'));
  const { batteryTime, homeDistanceM, altRelM, positionAgeMs, batteryAgeMs } = facts;
  if ((batteryAgeMs ?? Infinity) > MAX_AGE_MS || (positionAgeMs ?? Infinity) > MAX_AGE_MS) {
    return unknown(t('its values are old'));
  }
  if (batteryTime === null) return unknown(t('its consumption is not known yet'));
  if (homeDistanceM === null || altRelM === null) return unknown(t('its home is not known'));
  const heightM = Math.max(0, altRelM);
  const fastM = Math.max(0, heightM - LANDING_BELOW_M);
  const wayS = homeDistanceM / speedHome(facts) + fastM / DOWN_MPS + (heightM - fastM) / LANDING_MPS;
  return { afterMs: batteryTime.leftMs - wayS * 1000, wayMs: wayS * 1000 };
}

/** A wind from the direction of home costs its whole speed; one from behind is not counted. */
function speedHome({ groundSpeedMps, wind, place, home }: WayHomeFacts): number {
  const isMoving = groundSpeedMps !== null && groundSpeedMps >= MOVING_MPS;
  const speedMps = isMoving ? groundSpeedMps : USUAL_MPS;
  if (!wind || !place || !home) return speedMps;
  const away = ((wind.fromDeg - bearingDeg(place, home)) * Math.PI) / 180;
  return Math.max(SLOWEST_MPS, speedMps - Math.max(0, wind.mps * Math.cos(away)));
}
