/** Why a drone does what nobody commanded, in a few words beside its mode: "Battery Failsafe, 13.3 V". Pure. */

import { t } from '../languages/text';
import type { Alert } from '../link/alerts';
import type { FlightValues } from '../link/flight_values';
import { fixed } from './format';

/** Of the autopilot's own failsafe; its words begin with who says it. */
const SAID = 'failsafe';
const BREACHED: ReadonlySet<string> = new Set(['fence-breached', 'zone-breached']);

/** `alerts`: the open ones of the drone, the most urgent first. Empty: nothing but a command explains its mode. */
export function stateCause(alerts: readonly Alert[], values: Pick<FlightValues, 'batteryV'>): string {
  const alert = alerts.find(({ rule }) => rule === SAID || BREACHED.has(rule));
  if (alert === undefined) return '';
  if (alert.rule !== SAID) return alert.badge;
  const cause = alert.words
    .slice(alert.words.indexOf(': ') + 1)
    .trim()
    .replace(/\.$/, '');
  const isBattery = /batter/i.test(cause) && !/\d\s?V\b/.test(cause);
  return isBattery && values.batteryV !== null
    ? t('{cause}, {volts} V', { cause, volts: fixed(values.batteryV, 1) })
    : cause;
}
