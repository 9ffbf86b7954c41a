/** What all plan file formats share: the result of reading, what was dropped, how numbers are written. */

import { t } from '../../languages/text';
import { datumOf, FRAME } from '../frames';
import { MAX_ITEMS, type Plan, type PlanDefaults } from '../plan_types';
import { float32 } from '../wire_items';
import type { FoundArea, FoundMark, FoundRoute } from './found_shapes';

export type PlanFormat =
  | 'QGroundControl plan'
  | 'waypoint file'
  | 'fence file'
  | 'rally file'
  | 'polygon file'
  | 'GeoJSON'
  | 'KML'
  | 'KMZ'
  | 'GPX'
  | 'CSV'
  | 'shapefile'
  | 'saved plan';

export interface ReadFile {
  readonly format: PlanFormat;
  readonly plan: Plan;
  /** Lines and points without a stated meaning, of formats that have them. */
  readonly routes?: readonly FoundRoute[];
  readonly marks?: readonly FoundMark[];
  /** Outlines without a stated meaning: a field to survey, or a fence. */
  readonly areas: readonly FoundArea[];
  /** What was not read, one sentence each. */
  readonly dropped: readonly string[];
  /** What was read as it probably is meant, one sentence each. */
  readonly assumed?: readonly string[];
}

export interface WrittenFile {
  readonly text: string;
  /** What this kind of file cannot hold. */
  readonly dropped: readonly string[];
}

/** The file is invalid; the message is for people and says what to do. */
export class NotAPlanFile extends Error {
  override readonly name = 'NotAPlanFile';
}

export interface ReadSettings {
  /** For values missing in the file. */
  readonly defaults: PlanDefaults;
  /** The file's name: fences and outlines of fields can look alike. */
  readonly fileName?: string;
}

const MAX_FLOAT32 = 3.4028234663852886e38;

/** A file's number as float32; null if it is not a number. */
export const float32Of = (value: unknown): number | null =>
  typeof value === 'number' && Math.abs(value) <= MAX_FLOAT32 ? float32(value) : null;

/** The shortest digits for this float32: 30.1, not 30.100000381469727. */
export function shortFloat(value: number): number {
  for (let digits = 1; digits < 9; digits += 1) {
    const short = Number(value.toPrecision(digits));
    if (Math.fround(short) === Math.fround(value)) return short;
  }
  return Number(value.toPrecision(9));
}

/** The commands whose fifth and sixth parameters are plain numbers in any frame: camera, gimbal, scripts. */
const NUMBERS_ONLY: ReadonlySet<number> = new Set([202, 203, 204, 205, 42_702, 42_703]);

/** Whether x and y of such an item are 1e-7 degrees in a transfer, and degrees in a file. */
export const isScaled = (command: number, frame: number): boolean =>
  frame !== FRAME.MISSION && datumOf(frame) !== null && !NUMBERS_ONLY.has(command);

/** From a file's degrees (or plain number) to the wire's integer; null if out of range. */
export function axisOf(value: number, scaled: boolean): number | null {
  const whole = Math.round(scaled ? value * 1e7 : value);
  return Math.abs(whole) <= 0x7fff_ffff ? whole + 0 : null;
}

export const axisInFile = (axis: number, scaled: boolean): number => (scaled ? axis / 1e7 : axis);

export function heldToMost(count: number, what: string): void {
  if (count <= MAX_ITEMS) return;
  throw new NotAPlanFile(
    t('The file has {count} {what}; a drone takes {maxItems} at most. Split it into several files.', {
      count,
      what,
      maxItems: MAX_ITEMS,
    }),
  );
}
