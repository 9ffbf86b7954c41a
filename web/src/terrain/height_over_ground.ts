/** A drone's height above the ground under it. Pure. */

import type { FlightValues } from '../link/flight_values';
import type { Place } from '../link/messages';
import type { GroundHeight } from './height_tiles';

type Known = Pick<FlightValues, 'place' | 'home' | 'altRelM' | 'altAmslM'>;

/**
 * Measured from the ground at home, so that a receiver that has the height of home wrong by some metres does not count;
 * above the sea where home is not known. Null: not known.
 */
export function heightOverGroundM(values: Known, heightM: (place: Place) => GroundHeight): number | null {
  const { place, home, altRelM, altAmslM } = values;
  const under = place ? heightM(place) : null;
  if (typeof under !== 'number') return null;
  const atHome = home ? heightM(home) : null;
  if (typeof atHome === 'number' && altRelM !== null) return altRelM + atHome - under;
  return altAmslM === null ? null : altAmslM - under;
}
