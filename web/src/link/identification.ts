/** Step responses of a recorded flight, as the tower fits them (docs/statistics.md). */

import type { Rest } from './rest';
import type { Schemas } from './rest_types';

export type Identification = Schemas['IdentificationView'];
export type IdentifiedAxis = Schemas['AxisView'];
export type Trace = Schemas['TraceView'];

/** Takes seconds. Raises RestError. */
export const readIdentification = (rest: Rest, flightId: number): Promise<Identification> =>
  rest.call('GET', '/flights/{flight_id}/identification', { path: { flight_id: flightId } });

/** Below it the drone did not act as such a system. */
export const GOOD_R_SQUARED = 0.8;
