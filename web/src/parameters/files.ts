/**
 * Reads and writes parameter files: Mission Planner's `.param` (NAME,VALUE per line) and QGroundControl's `.params`
 * (vehicle, component, name, value and kind per line); reads PX4's start scripts too (`param set-default NAME VALUE`).
 * The content determines the format, not the file's name.
 */

import { t } from '../languages/text';
import { valueText, type Parameter } from './kinds';

export class NotAParameterFile extends Error {}

export interface ParameterFile {
  readonly format: 'Mission Planner' | 'QGroundControl' | 'script';
  readonly values: ReadonlyMap<string, number>;
  /** What could not be read, in words. */
  readonly dropped: readonly string[];
}

const NAME = /^[A-Za-z][A-Za-z0-9_]{0,15}$/;
const NUMBER = /^([+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|0x[0-9a-f]{1,8})$/i;
/** On a computer set to German or French, where blanks separate the cells. */
const DECIMAL_COMMA = /^[+-]?\d+,\d+$/;
/** Of PX4, with the switch for "say nothing"; MAVProxy writes `param set` too. */
const SET_COMMAND = /^param\s+set(-default)?\s+(-s\s+)?/i;
const AUTOPILOT = '1';
const MAX_LISTED = 5;

/** Commas or blanks separate the cells; of ArduPilot's defaults, a mark of what nobody may change goes. */
function cellsOf(line: string): string[] {
  const blank = line.replace(/\s+@READONLY$/i, '').split(/\s+/);
  if (blank[0]!.includes(',') || blank.some((cell) => cell.startsWith(',') || cell.endsWith(','))) {
    return blank.join(' ').split(/\s*,\s*|\s+/);
  }
  return blank.map((cell) => (DECIMAL_COMMA.test(cell) ? cell.replace(',', '.') : cell));
}

/** Throws NotAParameterFile with a message for people. */
export function readParameterFile(text: string): ParameterFile {
  const values = new Map<string, number>();
  const strange: string[] = [];
  const twice = new Set<string>();
  let others = 0;
  let tabled = 0;
  const lines = text.replace(/^\uFEFF/, '').split(/\r\n|\n|\r/);
  const isScript = lines.some((line) => SET_COMMAND.test(line.trim()));
  /** Of a script: how many of its conditions a line stands in. */
  let depth = 0;
  let conditional = 0;
  let orders = 0;
  for (const [at, raw] of lines.entries()) {
    let line = raw.replace(/#.*$/, '').trim();
    if (line === '') continue;
    if (isScript) {
      if (/^fi\b/.test(line)) depth = Math.max(0, depth - 1);
      else if (/^if\b/.test(line)) depth += 1;
      const isSet = SET_COMMAND.test(line);
      if (!isSet) orders += 1;
      else if (depth > 0) conditional += 1;
      if (!isSet || depth > 0) continue;
      line = line.replace(SET_COMMAND, '');
    }
    const cells = cellsOf(line);
    const isTabled = cells.length === 5 && /^\d+$/.test(cells[0]!) && /^\d+$/.test(cells[1]!);
    if (isTabled) tabled += 1;
    if (isTabled && cells[1] !== AUTOPILOT) {
      others += 1;
      continue;
    }
    const [name = '', value = ''] = isTabled ? cells.slice(2) : cells;
    if ((!isTabled && cells.length !== 2) || !NAME.test(name) || !NUMBER.test(value)) {
      strange.push(t('line {at}', { at: at + 1 }));
      continue;
    }
    if (values.has(name)) twice.add(name);
    values.set(name, Number(value));
  }
  if (values.size === 0) {
    throw new NotAParameterFile(
      others > 0
        ? t('This file has no autopilot parameters, only those of other components.')
        : conditional > 0
          ? t('This script sets parameters under conditions only, which nobody can know here.')
          : t('This is not a parameter file: no line has a name and a number.'),
    );
  }
  if (strange.length > values.size) {
    throw new NotAParameterFile(t('This is not a parameter file: most lines are something else.'));
  }
  const dropped: string[] = [];
  if (strange.length > 0) {
    const more = strange.length - MAX_LISTED;
    const listed = strange.slice(0, MAX_LISTED).join(', ') + (more > 0 ? ` ${t('and {more} more', { more })}` : '');
    dropped.push(t('Lines without a name and a number: {listed}.', { listed }));
  }
  if (conditional > 0) dropped.push(t('{conditional} that the script sets under a condition only.', { conditional }));
  if (orders > 0) dropped.push(t('{orders} other lines of the script.', { orders }));
  if (others > 0) dropped.push(t('{others} of other components.', { others }));
  if (twice.size > 0)
    dropped.push(t('Listed more than once (the last one counts): {what}.', { what: [...twice].join(', ') }));
  const format = tabled > 0 ? 'QGroundControl' : 'Mission Planner';
  return { format: isScript ? 'script' : format, values, dropped };
}

const byName = (parameters: readonly Parameter[]): Parameter[] =>
  [...parameters].sort((a, b) => (a.name < b.name ? -1 : 1));

export function missionPlannerFile(parameters: readonly Parameter[], droneName: string, at: string): string {
  const lines = byName(parameters).map(({ name, value, kind }) => `${name},${valueText(value, kind)}`);
  return [`# ${oneLine(droneName)}, ${at}`, ...lines, ''].join('\n');
}

export function qgroundcontrolFile(parameters: readonly Parameter[], droneName: string, at: string): string {
  const lines = byName(parameters).map(({ name, value, kind }) =>
    [1, AUTOPILOT, name, valueText(value, kind), kind].join('\t'),
  );
  return [`# ${oneLine(droneName)}, ${at}`, '#', '# Vehicle-Id Component-Id Name Value Type', ...lines, ''].join('\n');
}

const oneLine = (text: string): string => text.replace(/\s+/g, ' ');
