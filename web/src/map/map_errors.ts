/** Which errors of the map are faults, and says each of them in words that reach the browser's log. */

import { t } from '../languages/text';

/** What a missing tile of imagery raises, so that the map stretches a coarser one. It is no fault. */
export const MISSING_TILE = t('No tile here');
/** What a tile of a map file raises while the tower cannot be reached, or the page is being left. */
export const UNREACHED_TILE = t('No tile now');

const AWAY = 503;
/** MapLibre's own requests have it without an answer. */
const UNREACHED = 0;

/** What MapLibre hands to its `error` event; `status`: of its requests to a server. */
interface MapError {
  readonly name?: string;
  readonly message: string;
  readonly status?: number;
}

/**
 * The error to report, or null if it is no fault: a tile that does not exist, one that its server does not give now
 * (the map shows a coarser one, or none), one that is not wanted any more. The console itself says when the tower is out
 * of reach.
 *
 * An error from one of MapLibre's workers is put together from its parts here. It is no native error, so a browser
 * would report it as "Error", without its words: hence a new one.
 */
export function faultOf(error: MapError): Error | null {
  if (error.message === MISSING_TILE || error.message === UNREACHED_TILE || error.name === 'AbortError') return null;
  // The library for PMTiles has the status in its words only.
  if (error.status === AWAY || error.status === UNREACHED || error.message === `Bad response code: ${AWAY}`)
    return null;
  return new Error(t('Map: {message}', { message: error.message || (error.name ?? t('no words')) }), { cause: error });
}
