/** What the map shows of the squad, from what the link layer knows. */

import type { Vehicle } from './link/vehicle';
import type { SceneDrone } from './map/overlay';
import { fixed } from './words/format';

/** On the monitor a trail says where a drone comes from; the whole track belongs to its own page. */
export const TRAIL_POINTS = 60;

/** Null while it has no position. */
export function sceneDrone(vehicle: Vehicle, nowMs: number, trackPoints: number): SceneDrone | null {
  const values = vehicle.values(nowMs);
  if (!values.place) return null;
  const { id, name } = vehicle.drone.get();
  return {
    id,
    name,
    detail: values.airborne ? `${fixed(values.altRelM)} m  ${fixed(values.groundSpeedMps)} m/s` : '',
    place: values.place,
    headingDeg: values.headingDeg ?? 0,
    state: values.state,
    track: vehicle.telemetry.track.slice(-trackPoints),
  };
}
