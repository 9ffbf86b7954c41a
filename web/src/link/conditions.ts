/** What about a drone wants attention as long as it lasts. Pure: from its values to a list, worst first. */

import type { FlightValues } from './flight_values';
import type { Drone } from './wire_types';

export type AlertSeverity = 'critical' | 'warning' | 'notice';

export interface Condition {
  /** Names the kind: one alert for each time that it begins. */
  readonly id: string;
  readonly severity: AlertSeverity;
  readonly text: string;
}

/** Judged by a clock, not by a message: see alert_feed.ts. */
export const SILENCE = 'autopilot-silent';
export const BATTERY_LOW_PERCENT = 30;
export const BATTERY_CRITICAL_PERCENT = 15;

/** In the air, and nobody has the controls. */
export function isUnattended(drone: Drone, values: Pick<FlightValues, 'airborne'>): boolean {
  return drone.holder === null && (drone.airborne || values.airborne);
}

/** `wasAirborne`: in the air when it was last heard. */
export function conditionsOf(drone: Drone, values: FlightValues, wasAirborne: boolean): Condition[] {
  const found: Condition[] = [];
  const say = (id: string, severity: AlertSeverity, text: string): number => found.push({ id, severity, text });
  if (!drone.online) {
    // One that was never on, or was switched off on the ground, is no news.
    if (wasAirborne) say('link-lost', 'critical', `Link lost while in the air. It will ${lostActionWords(drone)}.`);
    return found;
  }
  if (values.heartbeatAgeMs !== null && values.state === 'lost') {
    say(SILENCE, wasAirborne ? 'critical' : 'warning', 'Its autopilot is not heard any more.');
    return found;
  }
  if (values.state === 'alert') say('emergency', 'critical', 'Its autopilot says that it is in an emergency.');
  const battery = values.batteryPercent;
  if (battery !== null && battery <= BATTERY_CRITICAL_PERCENT) {
    say('battery-critical', 'critical', `Battery at ${BATTERY_CRITICAL_PERCENT} % or less.`);
  } else if (battery !== null && battery <= BATTERY_LOW_PERCENT) {
    say('battery-low', 'warning', `Battery at ${BATTERY_LOW_PERCENT} % or less.`);
  }
  // On the ground, before it is ready, an estimator has every right to be unsure.
  if (values.airborne && values.ekfIsHealthy === false) {
    say('ekf', 'critical', 'The position estimator (EKF) is not healthy.');
  }
  if (values.airborne && (values.gpsFix === 'none' || values.gpsFix === 'no fix')) {
    say('gps', 'warning', 'No GPS fix while in the air.');
  }
  if (isUnattended(drone, values)) say('unattended', 'warning', 'In the air, and nobody has the controls.');
  return found;
}

function lostActionWords({ lost_action: action, lost_action_s: afterS }: Drone): string {
  const words = {
    return: 'return',
    land: 'land',
    continue: 'continue its mission',
    nothing: 'do what its autopilot does',
  };
  return `hold, and after ${afterS} s ${words[action]}`;
}
