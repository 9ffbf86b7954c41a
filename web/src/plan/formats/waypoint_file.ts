/**
 * The text files of Mission Planner and MAVProxy (`.waypoints`): "QGC WPL 110", then one item a line: index, current, frame, command,
 * four parameters, latitude, longitude, height, autocontinue. Line 0 is home. Mission Planner keeps fence and rally points in
 * files of the same form.
 */

import { CMD } from '../catalogue';
import { FRAME } from '../frames';
import { EMPTY_PLAN, type Param, type Plan, type PlanKind, type Spot, type WireItem } from '../plan_types';
import { itemsOf, wireItem, withItems } from '../wire_items';
import {
  axisInFile,
  axisOf,
  counted,
  float32Of,
  heldToMost,
  isScaled,
  NotAPlanFile,
  shortFloat,
  type ReadFile,
  type ReadSettings,
  type WrittenFile,
} from './plan_file';

const MAGIC = 'QGC WPL';
const VERSION = 110;
const FIELDS = 12;

export const looksLikeWaypoints = (text: string): boolean => text.startsWith(MAGIC);

function kindOf(command: number): PlanKind {
  if (command >= CMD.FENCE_RETURN && command <= CMD.FENCE_CIRCLE_OUT) return 'fence';
  return command === CMD.RALLY ? 'rally' : 'mission';
}

function numberOf(text: string, line: number): number | null {
  if (text.toLowerCase() === 'nan') return null;
  const value = text === '' ? NaN : Number(text);
  if (Number.isNaN(value)) throw new NotAPlanFile(`Line ${line}: "${text.slice(0, 20)}" is not a number.`);
  return value;
}

function wholeOf(text: string, line: number, what: string, most: number): number {
  const value = numberOf(text, line);
  if (value !== null && Number.isInteger(value) && value >= 0 && value <= most) return value;
  throw new NotAPlanFile(`Line ${line}: ${what} is not a whole number from 0 to ${most}.`);
}

function itemOfLine(fields: readonly string[], line: number): WireItem {
  const frame = wholeOf(fields[2]!, line, 'the frame', 0xff);
  const command = wholeOf(fields[3]!, line, 'the command', 0xffff);
  const params = fields.slice(4, 8).map((text): Param => {
    const value = numberOf(text, line);
    if (value === null) return null;
    const short = float32Of(value);
    if (short === null) throw new NotAPlanFile(`Line ${line}: ${text} is too large a number.`);
    return short;
  });
  const scaled = isScaled(command, frame);
  const [x, y] = fields.slice(8, 10).map((text) => axisOf(numberOf(text, line) ?? 0, scaled));
  const z = float32Of(numberOf(fields[10]!, line) ?? 0);
  if (typeof x !== 'number' || typeof y !== 'number' || z === null) {
    throw new NotAPlanFile(`Line ${line}: that is not a place on earth.`);
  }
  const autocontinue = wholeOf(fields[11]!, line, 'autocontinue', 0xff);
  return wireItem(command, frame, [params[0]!, params[1]!, params[2]!, params[3]!], x, y, z, autocontinue);
}

export function readWaypoints(text: string, settings: ReadSettings): ReadFile {
  const lines = text.split(/\r\n|\r|\n/);
  const [first = ''] = lines;
  if (!looksLikeWaypoints(first))
    throw new NotAPlanFile('This is not a waypoint file: its first line is not "QGC WPL 110".');
  const version = first.slice(MAGIC.length).trim();
  if (version !== `${VERSION}`) {
    throw new NotAPlanFile(
      `This is a waypoint file of version ${version || '(none)'}; only version ${VERSION} can be read.`,
    );
  }
  const all: WireItem[] = [];
  for (const [at, line] of lines.entries()) {
    if (at === 0 || line.trim() === '' || line.startsWith('#')) continue;
    const fields = line.trim().split(/\s+/);
    if (fields.length !== FIELDS) {
      throw new NotAPlanFile(`Line ${at + 1} has ${counted(fields.length, 'field', 'fields')} instead of ${FIELDS}.`);
    }
    const index = wholeOf(fields[0]!, at + 1, 'the index', 0xffff);
    if (index !== all.length) {
      throw new NotAPlanFile(
        `Line ${at + 1} is item ${index}, but item ${all.length} was expected: a line is missing or twice.`,
      );
    }
    all.push(itemOfLine(fields, at + 1));
  }
  const dropped: string[] = [];
  const home = all[0]?.command === CMD.WAYPOINT && all[0].frame === FRAME.GLOBAL ? all.shift() : undefined;
  if (!home && all.length > 0) {
    dropped.push('Line 2 is no home, as such files begin with: it was taken for the first item.');
  }
  const of = (kind: PlanKind): WireItem[] => all.filter((item) => kindOf(item.command) === kind);
  // Jumps count from the file's first line, which is home.
  const first0 = home ? 1 : 0;
  const mission = of('mission').map((item): WireItem => {
    const target = item.params[0];
    if (item.command !== CMD.JUMP || target === null) return item;
    return { ...item, params: [target - first0, item.params[1], item.params[2], item.params[3]] };
  });
  for (const items of [mission, of('fence'), of('rally')]) heldToMost(items.length, 'items');
  const hasHome = home && (home.x !== 0 || home.y !== 0);
  let plan: Plan = {
    ...EMPTY_PLAN,
    defaults: settings.defaults,
    home: hasHome ? { spot: { latE7: home.x, lonE7: home.y }, altM: home.z } : null,
  };
  for (const [kind, items] of [
    ['mission', mission],
    ['fence', of('fence')],
    ['rally', of('rally')],
  ] as const) {
    const read = withItems(plan, kind, items);
    plan = read.plan;
    dropped.push(...read.dropped);
  }
  return { format: 'waypoint file', plan, areas: [], dropped };
}

const line = (index: number, item: WireItem): string => {
  const scaled = isScaled(item.command, item.frame);
  const axis = (value: number): string => (scaled ? axisInFile(value, true).toFixed(7) : `${value}`);
  const params = item.params.map((value) => (value === null ? 'NaN' : `${shortFloat(value)}`));
  const fields = [index, index === 0 ? 1 : 0, item.frame, item.command, ...params, axis(item.x), axis(item.y)];
  return [...fields, shortFloat(item.z), item.autocontinue].join('\t');
};

const NO_HOME: Spot = { latE7: 0, lonE7: 0 };

/** One kind of a plan: such a file has room for one. */
export function writeWaypoints(plan: Plan, kind: PlanKind = 'mission'): WrittenFile {
  const dropped: string[] = [];
  const { shapes, returnPoint } = plan.fence;
  const others: readonly [PlanKind, number, string][] = [
    ['mission', plan.items.length, counted(plan.items.length, 'item of the mission', 'items of the mission')],
    ['fence', shapes.length + (returnPoint ? 1 : 0), 'the fence'],
    ['rally', plan.rally.length, counted(plan.rally.length, 'rally point', 'rally points')],
  ];
  for (const [other, count, words] of others) {
    if (other !== kind && count > 0)
      dropped.push(`Not in this file: ${words}. Such a file holds one kind; write another.`);
  }
  if (!plan.home) dropped.push('The plan has no home: the file says 0, 0 in its place.');
  const { latE7, lonE7 } = plan.home?.spot ?? NO_HOME;
  const home = wireItem(CMD.WAYPOINT, FRAME.GLOBAL, [0, 0, 0, 0], latE7, lonE7, plan.home?.altM ?? 0);
  const items = itemsOf(plan, kind).map((item): WireItem => {
    if (item.command !== CMD.JUMP || item.params[0] === null) return item;
    return { ...item, params: [item.params[0] + 1, item.params[1], item.params[2], item.params[3]] };
  });
  const lines = [home, ...items].map((item, index) => line(index, item));
  return { text: `${MAGIC} ${VERSION}\n${lines.join('\n')}\n`, dropped };
}
