/** Flights that the tower recorded, page by page, newest first. */

import type { FlightKey } from './flight_imports';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';

export type Flight = Schemas['FlightView'];

/** Empty fields: any. `fromIso`, `untilIso`: when the drone was armed. */
export interface FlightFilter {
  readonly droneId: number | null;
  readonly pilot: string;
  readonly fromIso: string;
  readonly untilIso: string;
}

export interface FlightPage {
  readonly flights: readonly Flight[];
  readonly next: string | null;
}

export const ANY_FLIGHT: FlightFilter = { droneId: null, pilot: '', fromIso: '', untilIso: '' };

/** `before`: `next` of the page before. Raises RestError. */
export async function readFlights(rest: Rest, filter: FlightFilter, before: string | null = null): Promise<FlightPage> {
  const query = {
    ...(filter.droneId === null ? {} : { drone_id: filter.droneId }),
    ...(filter.pilot.trim() === '' ? {} : { pilot: filter.pilot.trim() }),
    ...(filter.fromIso === '' ? {} : { since: filter.fromIso }),
    ...(filter.untilIso === '' ? {} : { until: filter.untilIso }),
    ...(before === null ? {} : { before }),
  };
  return rest.call('GET', '/flights', { query });
}

/** The number of a recorded flight. */
export const flightIdOf = (flight: FlightKey): number => Number(flight);

export type FlightFile = 'tlog' | 'csv' | 'kml' | 'gpx';

export const FLIGHT_FILES: readonly FlightFile[] = ['tlog', 'csv', 'kml', 'gpx'];

export function flightFileHref(flightId: number, file: FlightFile): string {
  return `/api/v1/flights/${flightId}/${file === 'tlog' ? file : `export/${file}`}`;
}

/** What happened in a flight, for print. */
export const flightReportHref = (flightId: number): string => `/api/v1/flights/${flightId}/report`;
