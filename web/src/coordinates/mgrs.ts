/** Reads MGRS: "32TMT 65886 49507", "32TMT6588649507", "32TMT". Its place is the middle of the square. Pure. */

import type { Place } from '../link/messages';
import { utmToPlace } from './utm';

const MGRS = /^(\d{1,2}) ?([C-HJ-NP-X]) ?([A-HJ-NP-Z])([A-HJ-NP-V])((?: ?\d+){0,2})$/i;
const BANDS = 'CDEFGHJKLMNPQRSTUVWX';
const COLUMNS = ['ABCDEFGH', 'JKLMNPQR', 'STUVWXYZ'] as const;
const ROWS = 'ABCDEFGHJKLMNPQRSTUV';
/** In zones of an even number the rows begin at F. */
const EVEN_ROWS_FROM = 5;
const SQUARE_M = 100_000;
const ROWS_M = ROWS.length * SQUARE_M;
const BAND_DEG = 8;
/** A square of 100 km may reach out of its band by this. */
const BESIDE_BAND_DEG = 1;
const MAX_DIGITS = 5;
/** Some programs round a place just south of the equator into the square north of it. */
const MAX_NORTH_M = 10_100_000;

/** Null: it is no MGRS, or it names a square that there is not. */
export function readMgrs(text: string): Place | null {
  const found = MGRS.exec(text);
  if (!found) return null;
  const [zone, band, column, row] = [
    Number(found[1]),
    ...found.slice(2, 5).map((letter) => letter.toUpperCase()),
  ] as unknown as [number, string, string, string];
  const digits = digitsOf(found[5]!.trim());
  const columnAt = COLUMNS[(zone - 1) % 3]?.indexOf(column) ?? -1;
  if (zone < 1 || zone > 60 || columnAt < 0 || !digits) return null;
  const stepM = SQUARE_M / 10 ** digits.east.length;
  const inSquare = (part: string): number => (Number(part) + 0.5) * stepM;
  const rowAt = (ROWS.indexOf(row) - (zone % 2 === 0 ? EVEN_ROWS_FROM : 0) + ROWS.length) % ROWS.length;
  const eastM = (columnAt + 1) * SQUARE_M + inSquare(digits.east);
  const rowM = rowAt * SQUARE_M + inSquare(digits.north);
  const bandAt = BANDS.indexOf(band);
  const southDeg = bandAt * BAND_DEG - 80;
  const northDeg = band === 'X' ? 84 : southDeg + BAND_DEG;
  // The rows repeat every 2,000 km: the band says which is meant.
  for (let northM = rowM; northM < MAX_NORTH_M; northM += ROWS_M) {
    const place = utmToPlace(zone, band < 'N', eastM, northM);
    if (place.latDeg > southDeg - BESIDE_BAND_DEG && place.latDeg < northDeg + BESIDE_BAND_DEG) return place;
  }
  return null;
}

/** As many digits for east as for north, apart or together. */
function digitsOf(text: string): { east: string; north: string } | null {
  const parts = text === '' ? ['', ''] : text.split(' ');
  const [all] = parts;
  const [east, north] = parts.length === 2 ? parts : [all!.slice(0, all!.length / 2), all!.slice(all!.length / 2)];
  return east!.length === north!.length && east!.length <= MAX_DIGITS ? { east: east!, north: north! } : null;
}
