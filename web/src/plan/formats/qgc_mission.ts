/**
 * The mission in QGroundControl's JSON, of every version since 2015: the items of a `.plan` with seven parameters,
 * earlier ones with four and a "coordinate", and those of the first `.mission` with "param1" to "param4". For surveys
 * and corridors, reads the generated items; if the file has none (surveys before 2018, structure scans), the outline.
 */

import { plural, t } from '../../languages/text';
import { CMD } from '../catalogue';
import type { Param, PlannedHome, PlanItem, Spot, WireItem } from '../plan_types';
import { wireItem } from '../wire_items';
import { isNumber, isObject, latLonOf, objectsIn, type JsonObject } from './json_values';
import { axisOf, float32Of, heldToMost, isScaled, NotAPlanFile } from './plan_file';

const COMPLEX_WORDS: Readonly<Record<string, string>> = {
  survey: t('survey'),
  CorridorScan: t('corridor'),
  StructureScan: t('structure scan'),
  fwLandingPattern: t('landing pattern of a plane'),
  vtolLandingPattern: t('landing pattern of a VTOL'),
};

/** QGroundControl computed such a height from the terrain under the item. */
const ABOVE_TERRAIN_COMPUTED = 3;

interface Read {
  readonly item: WireItem;
  /** The id that jumps refer to. */
  readonly jumpId: number | null;
}

export interface ReadMission {
  readonly items: readonly PlanItem[];
  readonly home: PlannedHome | null;
  /** Outlines of patterns whose items the file lacks. */
  readonly areas: readonly (readonly Spot[])[];
}

const NUMBERED = ['param1', 'param2', 'param3', 'param4'] as const;

/** Seven, wherever this version stores them. */
function parametersOf(json: JsonObject, who: string): unknown[] {
  const { params, coordinate } = json;
  const first = Array.isArray(params) ? params : NUMBERED.map((name) => json[name]);
  if (first.includes(undefined)) throw new NotAPlanFile(t('{who} does not have its parameters.', { who }));
  const place = first.length === 4 && Array.isArray(coordinate) ? coordinate : [];
  const seven = [...first, ...place] as unknown[];
  if (first.length === 4 && place.length === 2) seven.push(0);
  if (seven.length !== 7) throw new NotAPlanFile(t('{who} does not have seven parameters.', { who }));
  return seven;
}

function simpleItem(json: JsonObject, who: string): Read {
  const { command, frame, doJumpId, id, autoContinue } = json;
  if (!Number.isInteger(command) || (command as number) < 0 || (command as number) > 0xffff) {
    throw new NotAPlanFile(t('{who} has no command.', { who }));
  }
  if (!Number.isInteger(frame) || (frame as number) < 0 || (frame as number) > 0xff) {
    throw new NotAPlanFile(t('{who} has no frame.', { who }));
  }
  const numbers = parametersOf(json, who).map((value, at): Param => {
    if (value === null) return null;
    if (!isNumber(value)) throw new NotAPlanFile(t('{who}: parameter {at} is not a number.', { who, at: at + 1 }));
    return value;
  });
  const short = numbers.slice(0, 4).map((value, at): Param => {
    const number = value === null ? null : float32Of(value);
    if (value !== null && number === null)
      throw new NotAPlanFile(t('{who}: parameter {at} is too large.', { who, at: at + 1 }));
    return number;
  });
  const [code, kind] = [command as number, frame as number];
  const scaled = isScaled(code, kind);
  const x = axisOf(numbers[4] ?? 0, scaled);
  const y = axisOf(numbers[5] ?? 0, scaled);
  const z = float32Of(numbers[6] ?? 0);
  if (x === null || y === null || z === null) throw new NotAPlanFile(t('{who} is not at a place on earth.', { who }));
  const four = [short[0]!, short[1]!, short[2]!, short[3]!] as const;
  const item = wireItem(code, kind, four, x, y, z, autoContinue === false ? 0 : 1);
  const jumpId = [doJumpId, id].find((one) => isNumber(one) && one > 0);
  return { item, jumpId: isNumber(jumpId) ? jumpId : null };
}

/** Properties of an item that a plan here cannot hold. */
function lostOf(json: JsonObject, who: string): string[] {
  if (json['AltitudeMode'] !== ABOVE_TERRAIN_COMPUTED) return [];
  return [t('{who}: its height was computed from the ground there; it is kept as a height above the sea.', { who })];
}

function outlineOf(json: JsonObject): Spot[] | null {
  const corners = Array.isArray(json['polygon']) ? json['polygon'].map(latLonOf) : [];
  return corners.length >= 3 && !corners.includes(null) ? (corners as Spot[]) : null;
}

function complexItems(json: JsonObject, who: string, dropped: string[], areas: Spot[][]): Read[] {
  const type = `${json['complexItemType'] ?? json['type'] ?? t('item without a kind')}`;
  const words = COMPLEX_WORDS[type] ?? `"${type.slice(0, 40)}"`;
  const style = json['TransectStyleComplexItem'];
  const items = isObject(style) ? style['Items'] : undefined;
  if (!Array.isArray(items)) {
    const outline = outlineOf(json);
    if (outline) areas.push(outline);
    const why = t('the file does not say which waypoints it stands for');
    dropped.push(
      outline
        ? t('{who}, a {words}: {why}. Its outline was taken, its settings were not.', { who, words, why })
        : t('{who}, a {words}, is left out: {why}.', { who, words, why }),
    );
    return [];
  }
  const reads = items.map((one, at) => {
    const part = t('{who}, part {at},', { who, at: at + 1 });
    if (!isObject(one)) throw new NotAPlanFile(t('{part} is not an item.', { part }));
    return simpleItem(one, part);
  });
  const held = plural(reads.length, { one: '{n} item', other: '{n} items' });
  dropped.push(
    t('{who}, a {words}: its {held} were taken, its outline and its settings for camera and spacing were not.', {
      who,
      words,
      held,
    }),
  );
  return reads;
}

const isComplex = (json: JsonObject): boolean =>
  /^complexItem$/i.test(`${json['type']}`) || (!('command' in json) && isObject(json['camera'] ?? json['grid']));

const isSimple = (json: JsonObject): boolean =>
  /^(simpleItem|missionItem)$/i.test(`${json['type']}`) ||
  ((json['type'] === undefined || json['type'] === null) && 'command' in json);

/** The first `.mission` has its surveys in a separate list, each with its index. */
function listOf(mission: JsonObject): unknown[] {
  if (!Array.isArray(mission['items'])) throw new NotAPlanFile(t('The mission of this plan has no list of items.'));
  const list = [...(mission['items'] as unknown[])];
  for (const survey of objectsIn(mission['complexItems'])) {
    const place = survey['id'];
    const before = isNumber(place)
      ? list.findIndex((one) => isObject(one) && isNumber(one['id']) && one['id'] > place)
      : -1;
    list.splice(before < 0 ? list.length : before, 0, { ...survey, type: 'ComplexItem', complexItemType: 'survey' });
  }
  return list;
}

/**
 * Maps the ids in parameter 1 of jumps to items. Mission Planner gives its items no ids: it counts them, with home as
 * 0.
 */
function seqByJumpId(reads: readonly Read[]): ReadonlyMap<number, number> {
  const seqOf = new Map<number, number>();
  const hasIds = reads.some(({ jumpId }) => jumpId !== null);
  for (const [seq, { jumpId }] of reads.entries()) {
    const id = hasIds ? jumpId : seq + 1;
    if (id !== null && !seqOf.has(id)) seqOf.set(id, seq);
  }
  return seqOf;
}

function homeOf(json: unknown): PlannedHome | null {
  const place = isObject(json) ? json['coordinate'] : json;
  const spot = latLonOf(place);
  if (!spot || (spot.latE7 === 0 && spot.lonE7 === 0)) return null;
  return { spot, altM: Array.isArray(place) ? (float32Of(place[2]) ?? 0) : 0 };
}

/** Adds what was not read to `dropped`; ids begin at `nextId`. Throws NotAPlanFile. */
export function readMission(mission: JsonObject, dropped: string[], nextId: number): ReadMission {
  const areas: Spot[][] = [];
  const reads = listOf(mission).flatMap((json: unknown, at: number): Read[] => {
    const who = t('Item {at}', { at: at + 1 });
    if (!isObject(json)) throw new NotAPlanFile(t('{who} is not an item.', { who }));
    if (isComplex(json)) return complexItems(json, who, dropped, areas);
    if (!isSimple(json)) throw new NotAPlanFile(t('{who} is of no kind that is known.', { who }));
    dropped.push(...lostOf(json, who));
    return [simpleItem(json, who)];
  });
  heldToMost(reads.length, t('items'));
  const seqOf = seqByJumpId(reads);
  const items = reads.map(({ item }, seq): PlanItem => {
    const target = item.command === CMD.JUMP ? item.params[0] : null;
    const to = target === null ? undefined : seqOf.get(target);
    if (target !== null && to === undefined)
      dropped.push(t('The jump in item {seq} goes to nothing: choose where to.', { seq: seq + 1 }));
    const [p1, p2, p3, p4] = item.params;
    const isLost = item.command === CMD.JUMP && to === undefined;
    return {
      ...item,
      params: [isLost ? -1 : (to ?? p1), p2, p3, p4],
      id: nextId + seq,
      jumpTo: to === undefined ? null : nextId + to,
    };
  });
  return { items, home: homeOf(mission['plannedHomePosition']), areas };
}
