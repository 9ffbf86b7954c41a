/** The head of a table of places: how its columns are divided, and what they are by their names. */

import { FRAME } from '../frames';

export type Column = 'lat' | 'lon' | 'height' | 'name' | 'place' | 'east' | 'north' | 'zone';

export interface TableHead {
  readonly delimiter: string;
  /** How many lines are before the first place. */
  readonly rows: number;
  /** Null: no line names the columns. */
  readonly columns: ReadonlyMap<Column, number> | null;
  readonly isFeet: boolean;
  /** What the heights count from; null if the name does not say. */
  readonly frame: number | null;
  readonly unused: readonly string[];
}

const DELIMITERS = [';', '\t', '|', ','] as const;
const COLUMNS: readonly (readonly [Column, RegExp])[] = [
  ['lat', /^(lat|latitude|latitud|y)\b/],
  ['lon', /^(lon|lng|long|longitude|longitud|x)\b/],
  ['height', /^(alt|altitude|altura|height|ele|elev|elevation|z)\b/],
  ['place', /^(place|position|coordinates?|coords?|location|lat ?lon|lat ?lng|mgrs|geo|point)\b/],
  ['east', /^(east|easting|este)\b/],
  ['north', /^(north|northing|norte)\b/],
  ['zone', /^(zone|utm ?zone|zona)\b/],
  ['name', /^(name|title|label|id|nome|waypoint|wp|no)\b/],
];
const MAX_HEAD_CHARACTERS = 10_000;

/** How most columns are divided; a head has no decimal commas. */
function delimiterOf(line: string): string {
  const counts = DELIMITERS.map((one) => line.split(one).length);
  return DELIMITERS[counts.indexOf(Math.max(...counts))]!;
}

const plain = (cell: string): string =>
  cell
    .replace(/^["'\s]+|["'\s]+$/g, '')
    .toLowerCase()
    .replace(/[_-]/g, ' ');

export function tableHead(text: string): TableHead {
  const [first = '', second = ''] = text.slice(0, MAX_HEAD_CHARACTERS).split(/\r\n|\r|\n/);
  // Spreadsheets say in a line of its own what divides the columns.
  const said = /^sep=(.)$/i.exec(first);
  const line = said ? second : first;
  const delimiter = said?.[1] ?? delimiterOf(line);
  const cells = line.split(delimiter).map(plain);
  const columns = new Map<Column, number>();
  const unused: string[] = [];
  for (const [at, cell] of cells.entries()) {
    const column = COLUMNS.find(([name, pattern]) => pattern.test(cell) && !columns.has(name))?.[0];
    if (column) columns.set(column, at);
    else if (cell) unused.push(cell);
  }
  const rows = said ? 1 : 0;
  const hasPlace =
    columns.has('place') ||
    [
      ['lat', 'lon'],
      ['east', 'north'],
    ].some((pair) => pair.every((one) => columns.has(one as Column)));
  if (!hasPlace) {
    // Numbers with decimal commas are divided by something else.
    const divided = DELIMITERS.find((one) => line.includes(one)) ?? ',';
    return { delimiter: said?.[1] ?? divided, rows, columns: null, isFeet: false, frame: null, unused: [] };
  }
  const height = cells[columns.get('height') ?? -1] ?? '';
  const frame = /sea|msl/.test(height)
    ? FRAME.GLOBAL
    : /ground|agl|terrain/.test(height)
      ? FRAME.GLOBAL_TERRAIN_ALT
      : /home|rel/.test(height)
        ? FRAME.GLOBAL_RELATIVE_ALT
        : null;
  return { delimiter, rows: rows + 1, columns, isFeet: /\b(ft|feet)\b/.test(height), frame, unused };
}

/** Whether a text is a table of places; one without a head only by the name of its file. */
export function looksLikeTable(text: string, fileName: string): boolean {
  return /\.(csv|tsv)$/i.test(fileName) || tableHead(text).columns !== null;
}
