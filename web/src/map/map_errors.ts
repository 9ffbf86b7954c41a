/** Which errors of the map are faults, and says each of them in words that reach the browser's log. */

import { MISSING_TILE } from './missing_tile';

const AWAY = 503;

/** What MapLibre hands to its `error` event; `status` only after an answer of a server. */
interface MapError {
  readonly name: string;
  readonly message: string;
  readonly status?: number;
}

/**
 * The error to report, or null if it is no fault: a tile that does not exist, one that its server does not give now
 * (the map shows a coarser one, or none), one that is not wanted any more.
 *
 * An error from one of MapLibre's workers is put together from its parts here. It is no native error, so a browser
 * would report it as "Error", without its words: hence a new one.
 */
export function faultOf(error: MapError): Error | null {
  if (error.message === MISSING_TILE || error.name === 'AbortError') return null;
  // The library for PMTiles has the status in its words only.
  if (error.status === AWAY || error.message === `Bad response code: ${AWAY}`) return null;
  return new Error(`Map: ${error.message || error.name}`, { cause: error });
}
