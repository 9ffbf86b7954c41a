/** In the air without a holder: for the marks of map and rows at the moment it happens. The alert is the tower's. Pure. */

import type { FlightValues } from './flight_values';
import type { Drone } from './wire_types';

export function isUnattended(drone: Drone, values: Pick<FlightValues, 'airborne'>): boolean {
  return drone.holder === null && (drone.airborne === true || values.airborne === true);
}
