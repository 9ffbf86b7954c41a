/** Conditions of a drone that need attention as long as they last. Pure: from its values to a list, worst first. */

import { batteryLevel, batteryWords } from './battery_level';
import type { FlightValues } from './flight_values';
import { DOES } from './hold_view';
import { lastHeard, lostLinkWords } from './loss_countdown';
import type { Drone, HoldView } from './wire_types';

export type AlertSeverity = 'critical' | 'warning' | 'notice';

export interface Condition {
  /** Names the kind: one alert each time the condition begins. */
  readonly id: string;
  readonly severity: AlertSeverity;
  readonly text: string;
}

/** Judged by a clock, not by a message: see alert_feed.ts. */
export const SILENCE = 'autopilot-silent';

const WRONG_PLACE = 'Its position on the map may be wrong, and others are not warned of it.';
const MOTION_WORDS: Record<NonNullable<Drone['suspicious_motion']>, string> = {
  jump: `Its position jumped. ${WRONG_PLACE}`,
  speed: `It says that it flies faster than a drone can. ${WRONG_PLACE}`,
  height: `It says that it is where no drone can fly: too high or too low. ${WRONG_PLACE}`,
  course: `It does not go where its speed says. ${WRONG_PLACE}`,
};

/** In the air without a holder. */
export function isUnattended(drone: Drone, values: Pick<FlightValues, 'airborne'>): boolean {
  return drone.holder === null && (drone.airborne === true || values.airborne === true);
}

/** `wasAirborne`: in the air at the last report; null: unknown. */
export function conditionsOf(drone: Drone, values: FlightValues, wasAirborne: boolean | null): Condition[] {
  const found: Condition[] = [];
  const say: Say = (id, severity, text) => found.push({ id, severity, text });
  if (!drone.online) {
    // A drone that was never online, or was switched off on the ground, is no news.
    if (wasAirborne) say('link-lost', 'critical', `Link lost while in the air. ${lastWords(drone, values)}`);
    return found;
  }
  sayLostAction(drone.hold, say);
  if (values.heartbeatAgeMs !== null && values.state === 'lost') {
    say(SILENCE, wasAirborne ? 'critical' : 'warning', 'Its autopilot is silent.');
    return found;
  }
  if (values.state === 'alert') say('emergency', 'critical', 'Its autopilot reports an emergency.');
  const level = batteryLevel(values);
  if (level !== null) {
    const severity = level === 'critical' ? 'critical' : 'warning';
    say(`battery-${level}`, severity, `${batteryWords(level, values)}.`);
  }
  // On the ground an estimator may be uncertain until it is ready.
  if (values.airborne && values.ekfIsHealthy === false) {
    say('ekf', 'critical', 'The position estimator (EKF) is not healthy.');
  }
  if (values.airborne && (values.gpsFix === 'none' || values.gpsFix === 'no fix')) {
    say('gps', 'warning', 'No GPS fix while in the air.');
  }
  if (drone.suspicious_motion) say('motion', 'warning', MOTION_WORDS[drone.suspicious_motion]);
  if (isUnattended(drone, values)) say('unattended', 'warning', 'In the air, and nobody has the controls.');
  return found;
}

type Say = (id: string, severity: AlertSeverity, text: string) => void;

/** The drone's holder or tower is lost: reports the start of the countdown, and the drone's action. */
function sayLostAction(hold: HoldView | null, say: Say): void {
  if (hold === null || hold.lost === null) return;
  const action = hold.action === null ? undefined : DOES[hold.action];
  const does = action ? `It ${action}` : 'It acts by itself';
  if (hold.phase === 'counting') {
    const why = hold.lost === 'person' ? 'Nobody flies it.' : 'It has lost the tower.';
    const due = hold.due_at === null ? NaN : Date.parse(hold.due_at);
    const when = Number.isFinite(due) ? ` at ${new Date(due).toISOString().slice(11, 19)} UTC` : ' soon';
    const unless = hold.lost === 'person' && hold.action !== 'stay' ? ', unless somebody flies it or says "stay"' : '';
    say('lost-action-counting', 'warning', `${why} ${does}${when}${unless}.`);
  } else if (hold.phase === 'asking' || hold.phase === 'done') {
    const why = hold.lost === 'person' ? 'nobody flew it' : 'it had lost the tower';
    say('lost-action', 'warning', `${does}: ${why}.`);
  }
}

function lastWords(drone: Drone, values: FlightValues): string {
  return lostLinkWords('It', lastHeard(drone, values, true));
}
