/**
 * What is wrong with a drone, for every place that shows one: list, row, card, map and flight bar. One drone has one
 * trouble, its worst. Pure.
 */

import { batteryLevel } from './battery_level';
import { isUnattended } from './conditions';
import type { FlightValues } from './flight_values';
import type { Drone } from './wire_types';

/** The worst first. What can still be flown comes after what cannot; the battery before what waits for a person. */
export const TROUBLES = [
  'link-lost',
  'silent',
  'battery-critical',
  'battery-low',
  'emergency',
  'counting',
  'unattended',
] as const;
export type TroubleKind = (typeof TROUBLES)[number];

export interface Trouble {
  readonly kind: TroubleKind;
  readonly severity: 'critical' | 'warning';
  /** A few words for a row. */
  readonly badge: string;
  /** Smaller is worse. */
  readonly rank: number;
}

const BADGES: Record<TroubleKind, string> = {
  'link-lost': 'Lost in the air',
  silent: 'Autopilot silent',
  'battery-critical': 'Battery critical',
  'battery-low': 'Battery low',
  emergency: 'Emergency',
  counting: 'Acts by itself',
  unattended: 'Unattended',
};
const CRITICAL: ReadonlySet<TroubleKind> = new Set(['link-lost', 'silent', 'battery-critical', 'emergency']);
/** A battery that is low on the ground endangers nobody. */
const ON_GROUND_RANK = TROUBLES.length;

/** A lost link matters in the air: a drone that was switched off on the ground is no news. */
export const isLostInAir = (drone: Pick<Drone, 'online'>, wasAirborne: boolean | null): boolean =>
  !drone.online && wasAirborne === true;

/** `wasAirborne`: in the air at the last report; null: unknown. */
export function troubleOf(drone: Drone, values: FlightValues, wasAirborne: boolean | null): Trouble | null {
  if (!drone.online) return isLostInAir(drone, wasAirborne) ? trouble('link-lost') : null;
  if (values.heartbeatAgeMs !== null && values.state === 'lost') return wasAirborne ? trouble('silent') : null;
  const level = batteryLevel(values);
  if (level !== null) {
    const found = trouble(level === 'low' ? 'battery-low' : 'battery-critical');
    if (values.airborne !== false || drone.airborne === true) return found;
    return values.state === 'alert' ? trouble('emergency') : { ...found, rank: ON_GROUND_RANK };
  }
  if (values.state === 'alert') return trouble('emergency');
  if (drone.hold !== null && drone.hold.phase !== 'quiet') return trouble('counting');
  return isUnattended(drone, values) ? trouble('unattended') : null;
}

function trouble(kind: TroubleKind): Trouble {
  const severity = CRITICAL.has(kind) ? 'critical' : 'warning';
  return { kind, severity, badge: BADGES[kind], rank: TROUBLES.indexOf(kind) };
}
