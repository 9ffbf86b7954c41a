/**
 * A table of places (CSV, as spreadsheets write it): one mark for each row, read with the reader of all fields for
 * places. Loaded when such a file is opened.
 */

import { parse } from 'papaparse';

import { readPlace } from '../../coordinates/read_coordinate';
import { plural, t } from '../../languages/text';
import { FRAME } from '../frames';
import { HEIGHTS_FROM } from './found_shapes';
import { readFeatures } from './geojson_plan';
import type { JsonObject } from './json_values';
import { NotAPlanFile, type ReadFile, type ReadSettings } from './plan_file';
import { tableHead, type Column, type TableHead } from './table_head';

const MAX_ROWS = 20_000;
const FOOT_M = 0.3048;
const HEIGHT = /^[-+]?(\d+([.,]\d*)?|[.,]\d+)$/;

/** A row is read by the columns that the head names; without a head the first is the latitude. */
export function readCsv(text: string, settings: ReadSettings): ReadFile {
  const head = tableHead(text);
  const table = parse<string[]>(text, {
    delimiter: head.delimiter,
    skipEmptyLines: 'greedy',
    preview: MAX_ROWS + head.rows + 1,
  });
  const rows = table.data.slice(head.rows);
  if (rows.length > MAX_ROWS) {
    throw new NotAPlanFile(t('This table has more than {maxRows} rows: it is no plan.', { maxRows: MAX_ROWS }));
  }
  const columns =
    head.columns ??
    new Map<Column, number>([
      ['lat', 0],
      ['lon', 1],
      ['height', 2],
    ]);
  const faults: string[] = [];
  let unreadHeights = 0;
  const features = rows.flatMap((row): JsonObject[] => {
    const cell = (column: Column): string => row[columns.get(column) ?? -1]?.trim() ?? '';
    const { place, fault } = readPlace(placeText(cell));
    if (!place) {
      faults.push(fault);
      return [];
    }
    const height = cell('height');
    const heightM = HEIGHT.test(height) ? Number(height.replace(',', '.')) * (head.isFeet ? FOOT_M : 1) : null;
    if (height !== '' && heightM === null) unreadHeights += 1;
    const coordinates = [place.lonDeg, place.latDeg, ...(heightM === null ? [] : [heightM])];
    const from = head.frame === null ? {} : { [HEIGHTS_FROM]: head.frame };
    return [{ properties: { name: cell('name') }, geometry: { type: 'Point', coordinates, ...from } }];
  });
  const read = readFeatures(features, settings, 'CSV');
  const counted = (n: number): string => plural(n, { one: '{n} row', other: '{n} rows' });
  return {
    ...read,
    dropped: [
      ...read.dropped,
      ...(faults.length > 0
        ? [t('{counted} left out. The first: {fault}', { counted: counted(faults.length), fault: faults[0]! })]
        : []),
      ...(unreadHeights > 0
        ? [t('The heights of {counted} are not numbers.', { counted: counted(unreadHeights) })]
        : []),
      ...(head.unused.length > 0
        ? [t('Columns that are not read: {columns}.', { columns: head.unused.slice(0, 12).join(', ') })]
        : []),
    ],
    assumed: [...(read.assumed ?? []), ...assumptions(head)],
  };
}

function placeText(cell: (column: Column) => string): string {
  if (cell('place')) return cell('place');
  if (cell('east') && cell('north')) return `${cell('zone')} ${cell('east')} ${cell('north')}`;
  const [lat, lon] = [cell('lat'), cell('lon')];
  return lat === '' && lon === '' ? '' : /[NSEW]/i.test(lat + lon) ? `${lat} ${lon}` : `${lat}; ${lon}`;
}

function assumptions({ columns, isFeet, frame }: TableHead): string[] {
  const from: Partial<Record<number, string>> = {
    [FRAME.GLOBAL]: t('Heights are above the sea, by the name of their column.'),
    [FRAME.GLOBAL_TERRAIN_ALT]: t('Heights are above the ground, by the name of their column.'),
    [FRAME.GLOBAL_RELATIVE_ALT]: t('Heights are above home, by the name of their column.'),
  };
  return [
    ...(columns ? [] : [t('The table has no head: its first column is the latitude, its second the longitude.')]),
    ...(isFeet ? [t('Heights are in feet, by the name of their column.')] : []),
    ...(frame !== null && from[frame] ? [from[frame]] : []),
  ];
}
