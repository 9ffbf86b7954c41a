/** The squad as a map scene, from the state of the link layer. */

import type { FlightValues } from './link/flight_values';
import { isToldOtherwise } from './link/trouble';
import { isUnattended as isUnattendedNow } from './link/unattended';
import type { Vehicle } from './link/vehicle';
import { nearLines, type NearLine } from './link/separation';
import type { SeparationEvent } from './link/wire_types';
import type { SceneDrone } from './map/overlay';
import { ageWords } from './words/squad_words';
import { measured, type UnitSystem } from './words/units';

/** On the monitor a trail shows where a drone comes from; the whole track is on its own page. */
export const TRAIL_POINTS = 60;
const NO_TRACK: SceneDrone['track'] = [];

/** Null without a position. */
export function sceneDrone(
  vehicle: Vehicle,
  values: FlightValues,
  trackPoints: number,
  units: UnitSystem,
): SceneDrone | null {
  if (!values.place) return null;
  const drone = vehicle.drone.get();
  const age = ageWords(values);
  const height = measured(units, 'height', values.altRelM);
  const speed = measured(units, 'speed', values.groundSpeedMps);
  const isUnattended = isUnattendedNow(drone, values);
  const trouble = vehicle.trouble();
  const says =
    trouble && (!isToldOtherwise(trouble) || trouble.kind === 'unattended') ? trouble.badge.toLowerCase() : '';
  return {
    id: drone.id,
    name: says ? `${drone.name}: ${says}` : drone.name,
    detail: age || (values.airborne ? `${height}  ${speed}` : ''),
    place: values.place,
    // Whole metres: each change draws the map anew.
    upM: values.airborne ? Math.max(0, Math.round(values.altRelM ?? 0)) : 0,
    headingDeg: values.headingDeg ?? 0,
    state: values.state,
    track: trackPoints > 0 ? vehicle.telemetry.track.slice(-trackPoints) : NO_TRACK,
    isUnattended,
    ...(trouble && trouble.kind !== 'unattended' ? { alarm: trouble.severity } : {}),
    isStale: age !== '' || values.state === 'lost',
  };
}

/** Lines to nearby drones, for all drones or for one. */
export const sceneNear = (
  near: ReadonlyMap<number, SeparationEvent>,
  vehicles: ReadonlyMap<number, Vehicle>,
  units: UnitSystem,
  nowMs: number,
  onlyOf: number | null = null,
): NearLine[] =>
  nearLines(
    near.values(),
    (droneId) => vehicles.get(droneId)?.values(nowMs).place ?? null,
    (metres) => measured(units, 'height', metres, 0),
    onlyOf,
  );
