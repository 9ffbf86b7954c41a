/**
 * The text files of places of Mission Planner and MAVProxy: a fence (`.fen`, `.txt`: the return point, then the border,
 * which ends where it began), outlines of fields (`.poly`: only the border; several have a "Name:" each) and rally
 * points (`.ral`: "RALLY", latitude, longitude, height, break altitude, landing direction, flags).
 */

import { plural, t } from '../../languages/text';
import { FRAME } from '../frames';
import { EMPTY_PLAN, type FenceReturn, type RallyPoint, type Spot } from '../plan_types';
import { placeOf } from './json_values';
import { float32Of, heldToMost, NotAPlanFile, shortFloat, type ReadFile, type ReadSettings } from './plan_file';
import { linesOf, numberOf, wholeOf, type TextLine } from './text_lines';

const RALLY = /^rally$/i;
/** The title lines of Mission Planner before each of several outlines. */
const TITLE = /^(name|color):/i;
const NUMBER = /^[-+]?(\d|\.\d)/;

export function looksLikePoints(text: string): boolean {
  const [first] = linesOf(text.slice(0, 10_000));
  if (!first) return false;
  const [head = ''] = first.fields;
  return (
    RALLY.test(head) || TITLE.test(head) || (first.fields.length === 2 && first.fields.every((one) => NUMBER.test(one)))
  );
}

function spotOfLine(latitude: string, longitude: string, line: number): Spot {
  const spot = placeOf(numberOf(latitude, line), numberOf(longitude, line));
  if (!spot) throw new NotAPlanFile(t('Line {line}: that is not a place on earth.', { line }));
  return spot;
}

const isSame = (a: Spot | undefined, b: Spot | undefined): boolean => a?.latE7 === b?.latE7 && a?.lonE7 === b?.lonE7;

/** The corners, without the repeated first one at the end. */
function cornersOf(border: readonly Spot[], what: string): readonly Spot[] {
  const corners = border.length > 1 && isSame(border[0], border.at(-1)) ? border.slice(0, -1) : border;
  if (corners.length < 3) {
    throw new NotAPlanFile(
      t('{what} has {counted}; it needs three.', {
        what,
        counted: plural(corners.length, { one: '{n} corner', other: '{n} corners' }),
      }),
    );
  }
  heldToMost(corners.length, t('corners'));
  return corners;
}

/** Flags: bit 2 means that bits 3 and 4 give the reference of the height. */
const HEIGHT_FRAMES: readonly (number | null)[] = [
  FRAME.GLOBAL,
  FRAME.GLOBAL_RELATIVE_ALT,
  null,
  FRAME.GLOBAL_TERRAIN_ALT,
];

function rallyPoint({ fields, number: line }: TextLine, id: number, dropped: string[]): RallyPoint {
  if (fields.length !== 7 || !RALLY.test(fields[0]!)) {
    throw new NotAPlanFile(t('Line {line} is not "RALLY" with six numbers.', { line }));
  }
  const spot = spotOfLine(fields[1]!, fields[2]!, line);
  const [heightM, breakM, direction] = fields.slice(3, 6).map((one) => float32Of(numberOf(one, line)));
  if (typeof heightM !== 'number') throw new NotAPlanFile(t('Line {line} has no height.', { line }));
  const flags = wholeOf(fields[6]!, line, t('the flags'), 0xff);
  const reported = (flags & 4) !== 0 ? HEIGHT_FRAMES[(flags >> 3) & 3]! : FRAME.GLOBAL_RELATIVE_ALT;
  const lost = [
    ...(breakM ? [t('the height to break off at ({break} m)', { break: shortFloat(breakM) })] : []),
    ...(direction ? [t('the direction to land in ({direction})', { direction: shortFloat(direction) })] : []),
    ...(flags & 1 ? [t('"only with the wind"')] : []),
    ...(flags & 2 ? [t('"land at once"')] : []),
  ];
  if (lost.length > 0) dropped.push(t('Rally point {id} was taken without {lost}.', { id, lost: lost.join(', ') }));
  if (reported === null)
    dropped.push(t('Rally point {id}: its height above the origin was taken as one above home.', { id }));
  return { id, frame: reported ?? FRAME.GLOBAL_RELATIVE_ALT, spot, heightM };
}

function readRally(lines: readonly TextLine[], settings: ReadSettings): ReadFile {
  heldToMost(lines.length, t('rally points'));
  const dropped: string[] = [];
  const rally = lines.map((line, at) => rallyPoint(line, at + 1, dropped));
  const plan = { ...EMPTY_PLAN, defaults: settings.defaults, rally, nextId: rally.length + 1 };
  return { format: 'rally file', plan, areas: [], dropped };
}

function readOutlines(borders: readonly (readonly Spot[])[], settings: ReadSettings): ReadFile {
  const areas = borders.map((border, at) => ({
    name: '',
    corners: cornersOf(border, t('Outline {at}', { at: at + 1 })),
    holes: [],
  }));
  return { format: 'polygon file', plan: { ...EMPTY_PLAN, defaults: settings.defaults }, areas, dropped: [] };
}

/**
 * A border that ends at the first point of the file has no return point: it is an outline. If it is open, the file's
 * name decides.
 */
function isOutline(spots: readonly Spot[], settings: ReadSettings): boolean {
  if (isSame(spots[1], spots.at(-1))) return false;
  return isSame(spots[0], spots.at(-1)) || /\.poly$/i.test(settings.fileName ?? '');
}

export function readPoints(text: string, settings: ReadSettings): ReadFile {
  const lines = linesOf(text);
  if (RALLY.test(lines[0]?.fields[0] ?? '')) return readRally(lines, settings);
  const borders: Spot[][] = [[]];
  let hasTitles = false;
  for (const { fields, number } of lines) {
    if (TITLE.test(fields[0]!)) {
      hasTitles = true;
      if (borders.at(-1)!.length > 0) borders.push([]);
    } else if (fields.length === 2) {
      borders.at(-1)!.push(spotOfLine(fields[0]!, fields[1]!, number));
    } else {
      throw new NotAPlanFile(
        t('Line {number} has {counted}, not latitude and longitude.', {
          number,
          counted: plural(fields.length, { one: '{n} field', other: '{n} fields' }),
        }),
      );
    }
  }
  const [spots = []] = borders;
  if (hasTitles || isOutline(spots, settings)) return readOutlines(borders, settings);
  const [home, ...border] = spots;
  const corners = cornersOf(border, t('The border of this fence, behind its first line, the return point,'));
  const isGiven = home && (home.latE7 !== 0 || home.lonE7 !== 0);
  const returnPoint: FenceReturn | null = isGiven ? { frame: FRAME.GLOBAL_RELATIVE_ALT, spot: home, heightM: 0 } : null;
  // Fences of that time have only one border, an inclusion area.
  const shapes = [{ shape: 'polygon', id: 1, inclusion: true, group: 0, frame: FRAME.GLOBAL, corners } as const];
  const plan = { ...EMPTY_PLAN, defaults: settings.defaults, fence: { shapes, returnPoint }, nextId: 2 };
  return { format: 'fence file', plan, areas: [], dropped: [] };
}
