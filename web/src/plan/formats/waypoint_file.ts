/**
 * The text files of Mission Planner, MAVProxy and QGroundControl (`.waypoints`, `.txt`): "QGC WPL" and a version, then
 * one item per line.
 *
 * 110: index, current, frame, command, four parameters, latitude, longitude, height, autocontinue. Line 0 is home, and
 * jumps count it. 120: the same without home. 100, of 2010: index, frame, action, two parameters for turning, two for
 * waiting, current, longitude, latitude, height, yaw, autocontinue. Fence and rally points use the same file format;
 * MAVProxy writes these without home.
 */

import { plural, t } from '../../languages/text';
import { CMD } from '../catalogue';
import { FRAME } from '../frames';
import { EMPTY_PLAN, type Param, type Plan, type PlanKind, type Spot, type WireItem } from '../plan_types';
import { itemsOf, wireItem, withItems } from '../wire_items';
import {
  axisInFile,
  axisOf,
  float32Of,
  heldToMost,
  isScaled,
  NotAPlanFile,
  shortFloat,
  type ReadFile,
  type ReadSettings,
  type WrittenFile,
} from './plan_file';
import { linesOf, numberOf, wholeOf, type TextLine } from './text_lines';

const HEAD = /^QGC\s+WPL\b\s*(.*)$/;
const VERSION = 110;

/** Field positions in a line, by file version. */
interface Layout {
  readonly fields: number;
  readonly frame: number;
  readonly command: number;
  readonly params: readonly [number, number, number, number];
  readonly lat: number;
  readonly lon: number;
  readonly height: number;
  readonly autocontinue: number;
  readonly hasHome: boolean;
}

const LAYOUT_110: Layout = {
  fields: 12,
  frame: 2,
  command: 3,
  params: [4, 5, 6, 7],
  lat: 8,
  lon: 9,
  height: 10,
  autocontinue: 11,
  hasHome: true,
};
const LAYOUTS: ReadonlyMap<string, Layout> = new Map([
  [
    '100',
    {
      fields: 13,
      frame: 1,
      command: 2,
      params: [5, 6, 3, 4],
      lat: 9,
      lon: 8,
      height: 10,
      autocontinue: 12,
      hasHome: true,
    },
  ],
  [`${VERSION}`, LAYOUT_110],
  ['120', { ...LAYOUT_110, hasHome: false }],
]);

/** The actions of version 100. */
const ACTIONS: ReadonlyMap<number, number> = new Map([
  [2, CMD.TAKEOFF],
  [3, CMD.RETURN],
  [4, CMD.LAND],
  [24, CMD.TAKEOFF],
  [25, CMD.WAYPOINT],
  [26, CMD.LAND],
  [27, CMD.LOITER_UNLIMITED],
]);

export const looksLikeWaypoints = (text: string): boolean => text.startsWith('QGC WPL');

function kindOf(command: number): PlanKind {
  if (command >= CMD.FENCE_RETURN && command <= CMD.FENCE_CIRCLE_OUT) return 'fence';
  return command === CMD.RALLY ? 'rally' : 'mission';
}

function layoutOf(head: string): Layout {
  const version = HEAD.exec(head)?.[1]?.trim();
  if (version === undefined)
    throw new NotAPlanFile(t('This is not a waypoint file: its first line is not "QGC WPL 110".'));
  const layout = LAYOUTS.get(version);
  if (layout) return layout;
  if (version.startsWith('PB')) {
    throw new NotAPlanFile(
      t('This is a waypoint file in the form "PB": save it in MAVProxy as plain text, and open that.'),
    );
  }
  throw new NotAPlanFile(
    t('This is a waypoint file of version {version}; those that can be read are {what}.', {
      version: version || '(none)',
      what: [...LAYOUTS.keys()].join(', '),
    }),
  );
}

function itemOfLine({ fields, number: line }: TextLine, layout: Layout): WireItem {
  if (fields.length !== layout.fields) {
    throw new NotAPlanFile(
      t('Line {line} has {counted} instead of {fields}.', {
        line,
        counted: plural(fields.length, { one: '{n} field', other: '{n} fields' }),
        fields: layout.fields,
      }),
    );
  }
  const frame = wholeOf(fields[layout.frame]!, line, t('the frame'), 0xff);
  let command = wholeOf(fields[layout.command]!, line, t('the command'), 0xffff);
  if (layout.fields === 13) {
    const action = ACTIONS.get(command);
    if (action === undefined)
      throw new NotAPlanFile(t('Line {line}: action {command} is none of version 100.', { line, command }));
    command = action;
  }
  const params = layout.params.map((at): Param => {
    const value = numberOf(fields[at]!, line);
    if (value === null) return null;
    const short = float32Of(value);
    if (short === null)
      throw new NotAPlanFile(t('Line {line}: {fields} is too large a number.', { line, fields: fields[at] }));
    return short;
  });
  const scaled = isScaled(command, frame);
  const [x, y] = [layout.lat, layout.lon].map((at) => axisOf(numberOf(fields[at]!, line) ?? 0, scaled));
  const z = float32Of(numberOf(fields[layout.height]!, line) ?? 0);
  if (typeof x !== 'number' || typeof y !== 'number' || z === null) {
    throw new NotAPlanFile(t('Line {line}: that is not a place on earth.', { line }));
  }
  const autocontinue = wholeOf(fields[layout.autocontinue]!, line, 'autocontinue', 0xff);
  return wireItem(command, frame, [params[0]!, params[1]!, params[2]!, params[3]!], x, y, z, autocontinue);
}

/** Old Mission Planners wrote home with command 0. */
const isHome = (item: WireItem | undefined): item is WireItem => item?.command === CMD.WAYPOINT || item?.command === 0;

export function readWaypoints(text: string, settings: ReadSettings): ReadFile {
  const [head = '', ...rest] = text.split(/\r\n|\r|\n/);
  const layout = layoutOf(head);
  // An empty line in place of the header preserves the line numbers.
  const lines = linesOf(`\n${rest.join('\n')}`);
  const all = lines.map((line) => itemOfLine(line, layout));
  const indexes = lines.map((line) => wholeOf(line.fields[0]!, line.number, t('the index'), 0xffff));
  const dropped: string[] = [];
  const [firstIndex = 0] = indexes;
  const broken = indexes.findIndex((index, at) => index !== firstIndex + at);
  if (broken > 0) {
    dropped.push(
      t(
        'Line {number} is numbered {indexes}, not {firstIndex}: the lines were taken as they stand, and jumps count them.',
        { number: lines[broken]!.number, indexes: indexes[broken], firstIndex: firstIndex + broken },
      ),
    );
  }
  const home = layout.hasHome && firstIndex === 0 && isHome(all[0]) ? all.shift() : undefined;
  const of = (kind: PlanKind): WireItem[] => all.filter((item) => kindOf(item.command) === kind);
  if (home && home.frame !== FRAME.GLOBAL) {
    dropped.push(
      t('Line {number} is home in such files, and was taken for it, though its frame is {frame}.', {
        number: lines[0]!.number,
        frame: home.frame,
      }),
    );
  } else if (!home && layout.hasHome && of('mission').length > 0) {
    dropped.push(
      t('Line {number} is no home, as such files begin with: it was taken for the first item.', {
        number: lines[0]!.number,
      }),
    );
  }
  // Jumps count from the file's first line, which is home; a file that begins at 1 has omitted home.
  const first0 = home || (layout.hasHome && firstIndex === 1) ? 1 : 0;
  const flown = of('mission');
  const mission = flown.map((item, seq): WireItem => {
    const target = item.params[0];
    if (item.command !== CMD.JUMP || target === null) return item;
    const to = target - first0;
    if (!(to >= 0 && to < flown.length)) {
      dropped.push(t('The jump in item {seq} goes to nothing: choose where to.', { seq: seq + 1 }));
    }
    return { ...item, params: [to, item.params[1], item.params[2], item.params[3]] };
  });
  for (const items of [mission, of('fence'), of('rally')]) heldToMost(items.length, t('items'));
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

/** One kind of a plan: such a file holds only one. */
export function writeWaypoints(plan: Plan, kind: PlanKind = 'mission'): WrittenFile {
  const dropped: string[] = [];
  const { shapes, returnPoint } = plan.fence;
  const others: readonly [PlanKind, number, string][] = [
    [
      'mission',
      plan.items.length,
      plural(plan.items.length, { one: '{n} item of the mission', other: '{n} items of the mission' }),
    ],
    ['fence', shapes.length + (returnPoint ? 1 : 0), t('the fence')],
    ['rally', plan.rally.length, plural(plan.rally.length, { one: '{n} rally point', other: '{n} rally points' })],
  ];
  for (const [other, count, words] of others) {
    if (other !== kind && count > 0)
      dropped.push(t('Not in this file: {words}. Such a file holds one kind; write another.', { words }));
  }
  if (!plan.home) dropped.push(t('The plan has no home: the file says 0, 0 in its place.'));
  const { latE7, lonE7 } = plan.home?.spot ?? NO_HOME;
  const home = wireItem(CMD.WAYPOINT, FRAME.GLOBAL, [0, 0, 0, 0], latE7, lonE7, plan.home?.altM ?? 0);
  const items = itemsOf(plan, kind).map((item): WireItem => {
    if (item.command !== CMD.JUMP || item.params[0] === null) return item;
    return { ...item, params: [item.params[0] + 1, item.params[1], item.params[2], item.params[3]] };
  });
  const lines = [home, ...items].map((item, index) => line(index, item));
  return { text: `${t('QGC WPL {version}\n{lines}', { version: VERSION, lines: lines.join('\n') })}\n`, dropped };
}
