/**
 * Parallel lines over an area, at any angle, over concave areas too: no pictures are taken where a line leaves the
 * area.
 */

import { t } from '../../languages/text';
import { CMD } from '../catalogue';
import { FRAME } from '../frames';
import type { Spot, WireItem } from '../plan_types';
import { wireItem } from '../wire_items';
import { Drawing, heldToOutline, SurveyFault } from './area';

export interface Flown {
  readonly heightM: number;
  readonly frame: number;
  /** Between pictures; null: none. */
  readonly triggerM: number | null;
}

export interface GridSettings extends Flown {
  readonly spacingM: number;
  /** Direction of the first line, clockwise from north. */
  readonly angleDeg: number;
  /** How far it flies beyond the area before it turns. */
  readonly turnaroundM: number;
  /** The corner where it begins: 1 reverses the lines, 2 begins on the other side, 3 both. */
  readonly entry: 0 | 1 | 2 | 3;
}

/** One line: its pieces inside the area, and its ends. */
export interface Line {
  readonly from: Spot;
  readonly to: Spot;
  readonly pieces: readonly (readonly [Spot, Spot])[];
}

/** More lines than this are a mistake. */
export const MAX_LINES = 2_000;

/** The number of lines to cover a width; an excess of a hundredth of a line adds no line. */
export const lineCount = (widthM: number, spacingM: number): number => Math.max(1, Math.ceil(widthM / spacingM - 0.01));

/** Where a line at `across` meets the outline: in pairs of entry and exit. */
function meetings(ring: readonly (readonly [number, number])[], across: number): number[] {
  const alongs: number[] = [];
  for (const [at, [x1, y1]] of ring.entries()) {
    const [x2, y2] = ring[(at + 1) % ring.length]!;
    // Half-open: a corner counts for only one of its two edges.
    if (y1 > across !== y2 > across) alongs.push(x1 + ((across - y1) / (y2 - y1)) * (x2 - x1));
  }
  return alongs.sort((one, other) => one - other);
}

export function gridLines(drawn: readonly Spot[], settings: GridSettings): Line[] {
  const { spacingM, angleDeg, turnaroundM, entry } = settings;
  const area = heldToOutline(drawn);
  if (!(spacingM > 0)) throw new SurveyFault(t('The distance between lines must be above 0.'));
  if (!(turnaroundM >= 0 && turnaroundM <= 1_000))
    throw new SurveyFault(t('The turnaround distance is from 0 to 1000 m.'));
  const drawing = new Drawing(area, angleDeg);
  const ring = area.map((corner) => drawing.point(corner));
  const sides = ring.map(([, across]) => across);
  const [least, most] = [Math.min(...sides), Math.max(...sides)];
  const count = lineCount(most - least, spacingM);
  if (count > MAX_LINES) {
    throw new SurveyFault(
      t('That is {count} lines, {maxLines} are the most: lines farther apart, or a smaller area.', {
        count,
        maxLines: MAX_LINES,
      }),
    );
  }
  const first = (least + most) / 2 - ((count - 1) / 2) * spacingM;
  const places = Array.from({ length: count }, (_, at) => first + at * spacingM);
  if (entry & 2) places.reverse();
  const lines: Line[] = [];
  for (const across of places) {
    const alongs = meetings(ring, across);
    if (alongs.length < 2) continue;
    const isBack = (lines.length % 2 === 1) !== ((entry & 1) === 1);
    const ends = isBack ? alongs.toReversed() : alongs;
    const spot = (along: number): Spot => drawing.spot([along, across]);
    const beyond = isBack ? -turnaroundM : turnaroundM;
    const pieces: (readonly [Spot, Spot])[] = [];
    for (let at = 0; at + 1 < ends.length; at += 2) pieces.push([spot(ends[at]!), spot(ends[at + 1]!)]);
    lines.push({ from: spot(ends[0]! - beyond), to: spot(ends.at(-1)! + beyond), pieces });
  }
  return lines;
}

export const isSame = (one: Spot, other: Spot): boolean => one.latE7 === other.latE7 && one.lonE7 === other.lonE7;

export const waypointAt = (spot: Spot, { frame, heightM }: Pick<Flown, 'frame' | 'heightM'>): WireItem =>
  wireItem(CMD.WAYPOINT, frame, [0, 0, 0, null], spot.latE7, spot.lonE7, heightM);

/** The items that start and stop the pictures; none without pictures. */
export function pictureItems(triggerM: number | null): { readonly begin: WireItem[]; readonly end: WireItem[] } {
  if (triggerM === null) return { begin: [], end: [] };
  if (!(triggerM > 0)) throw new SurveyFault(t('The distance between photos must be above 0.'));
  const every = (metres: number, atOnce: number): WireItem =>
    wireItem(CMD.TRIGGER_DISTANCE, FRAME.MISSION, [metres, 0, atOnce, 0], 0, 0, 0);
  return { begin: [every(triggerM, 1)], end: [every(0, 0)] };
}

/** As mission items. Pictures start and stop at the border of the area. */
export function lineItems(lines: readonly Line[], flown: Flown): WireItem[] {
  const to = (spot: Spot): WireItem => waypointAt(spot, flown);
  const { begin, end } = pictureItems(flown.triggerM);
  return lines.flatMap((line): WireItem[] => {
    const pieces = line.pieces.flatMap(([from, until]) => [to(from), ...begin, to(until), ...end]);
    const lead = isSame(line.from, line.pieces[0]![0]) ? [] : [to(line.from)];
    const tail = isSame(line.to, line.pieces.at(-1)![1]) ? [] : [to(line.to)];
    return [...lead, ...pieces, ...tail];
  });
}

export const surveyItems = (area: readonly Spot[], settings: GridSettings): WireItem[] =>
  lineItems(gridLines(area, settings), settings);
