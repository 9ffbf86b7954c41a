/**
 * QGroundControl's `.plan`: JSON with mission, geoFence and rallyPoints. Simple items are MAVLink's; of surveys and corridors the items
 * that they were turned into are taken, their settings are not. Jumps name an item's `doJumpId`, not its place in the list.
 */

import { CMD } from '../catalogue';
import { FRAME } from '../frames';
import {
  EMPTY_PLAN,
  latDegOf,
  lonDegOf,
  type FenceShape,
  type Param,
  type Plan,
  type PlannedHome,
  type PlanItem,
  type RallyPoint,
  type Spot,
  type WireItem,
} from '../plan_types';
import { wireItem } from '../wire_items';
import { isNumber, isObject, latLonOf, objectsIn, type JsonObject } from './json_values';
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

/** MAV_AUTOPILOT and MAV_TYPE of the file's head: QGroundControl wants them; the items are the same for all. */
const FIRMWARE = { ardupilot: 3, px4: 12 } as const;
const QUADROTOR = 2;
const FENCE_VERSION = 2;

const COMPLEX_WORDS: Readonly<Record<string, string>> = {
  survey: 'survey',
  CorridorScan: 'corridor',
  StructureScan: 'structure scan',
  fwLandingPattern: 'landing pattern of a plane',
  vtolLandingPattern: 'landing pattern of a VTOL',
};

export const looksLikeQgcPlan = (json: unknown): json is JsonObject => isObject(json) && json['fileType'] === 'Plan';

interface Read {
  readonly item: WireItem;
  readonly jumpId: number | null;
}

function simpleItem(json: JsonObject, who: string): Read {
  const { command, frame, params, doJumpId, autoContinue } = json;
  if (!Number.isInteger(command) || (command as number) < 0 || (command as number) > 0xffff) {
    throw new NotAPlanFile(`${who} has no command.`);
  }
  if (!Number.isInteger(frame) || (frame as number) < 0 || (frame as number) > 0xff) {
    throw new NotAPlanFile(`${who} has no frame.`);
  }
  if (!Array.isArray(params) || params.length !== 7) throw new NotAPlanFile(`${who} does not have seven parameters.`);
  const numbers = params.map((value, at): Param => {
    if (value === null) return null;
    if (!isNumber(value)) throw new NotAPlanFile(`${who}: parameter ${at + 1} is not a number.`);
    return value;
  });
  const short = numbers.slice(0, 4).map((value, at): Param => {
    const number = value === null ? null : float32Of(value);
    if (value !== null && number === null) throw new NotAPlanFile(`${who}: parameter ${at + 1} is too large.`);
    return number;
  });
  const [code, kind] = [command as number, frame as number];
  const scaled = isScaled(code, kind);
  const x = axisOf(numbers[4] ?? 0, scaled);
  const y = axisOf(numbers[5] ?? 0, scaled);
  const z = float32Of(numbers[6] ?? 0);
  if (x === null || y === null || z === null) throw new NotAPlanFile(`${who} is not at a place on earth.`);
  const four = [short[0]!, short[1]!, short[2]!, short[3]!] as const;
  const item = wireItem(code, kind, four, x, y, z, autoContinue === false ? 0 : 1);
  return { item, jumpId: isNumber(doJumpId) ? doJumpId : null };
}

function complexItems(json: JsonObject, who: string, dropped: string[]): Read[] {
  const type = `${json['complexItemType'] ?? 'item without a kind'}`;
  const words = COMPLEX_WORDS[type] ?? `"${type.slice(0, 40)}"`;
  const style = json['TransectStyleComplexItem'];
  const items = isObject(style) ? style['Items'] : undefined;
  if (!Array.isArray(items)) {
    dropped.push(`${who}, a ${words}, is left out: the file does not say which waypoints it stands for.`);
    return [];
  }
  const reads = items.map((one, at) => {
    const part = `${who}, part ${at + 1},`;
    if (!isObject(one)) throw new NotAPlanFile(`${part} is not an item.`);
    return simpleItem(one, part);
  });
  const held = counted(reads.length, 'item', 'items');
  dropped.push(
    `${who}, a ${words}: its ${held} were taken, its outline and its settings for camera and spacing were not.`,
  );
  return reads;
}

function missionOf(mission: JsonObject, dropped: string[], nextId: number): PlanItem[] {
  if (!Array.isArray(mission['items'])) throw new NotAPlanFile('The mission of this plan has no list of items.');
  const reads = mission['items'].flatMap((json: unknown, at: number): Read[] => {
    const who = `Item ${at + 1}`;
    if (!isObject(json)) throw new NotAPlanFile(`${who} is not an item.`);
    if (json['type'] === 'ComplexItem') return complexItems(json, who, dropped);
    if (json['type'] !== 'SimpleItem') throw new NotAPlanFile(`${who} is of no kind that is known.`);
    return [simpleItem(json, who)];
  });
  heldToMost(reads.length, 'items');
  const seqOf = new Map<number, number>();
  for (const [seq, { jumpId }] of reads.entries()) {
    if (jumpId !== null && !seqOf.has(jumpId)) seqOf.set(jumpId, seq);
  }
  return reads.map(({ item }, seq): PlanItem => {
    const target = item.command === CMD.JUMP ? item.params[0] : null;
    const to = target === null ? undefined : seqOf.get(target);
    if (target !== null && to === undefined)
      dropped.push(`The jump in item ${seq + 1} goes to nothing: choose where to.`);
    const [p1, p2, p3, p4] = item.params;
    const isLost = item.command === CMD.JUMP && to === undefined;
    return {
      ...item,
      params: [isLost ? -1 : (to ?? p1), p2, p3, p4],
      id: nextId + seq,
      jumpTo: to === undefined ? null : nextId + to,
    };
  });
}

function fenceOf(geoFence: unknown, dropped: string[], nextId: number): Plan['fence'] {
  const shapes: FenceShape[] = [];
  if (!isObject(geoFence)) return { shapes, returnPoint: null };
  const version = geoFence['version'] ?? FENCE_VERSION;
  if (version !== FENCE_VERSION) {
    const what =
      version === 1 ? 'version 1, which says neither inside nor outside' : 'a version that is not known here';
    dropped.push(`The fence is left out: it is of ${what}. Draw it again.`);
    return { shapes, returnPoint: null };
  }
  let id = nextId;
  for (const [at, json] of objectsIn(geoFence['polygons']).entries()) {
    const corners = Array.isArray(json['polygon']) ? json['polygon'].map(latLonOf) : [];
    if (corners.length < 3 || corners.includes(null)) {
      dropped.push(`Polygon ${at + 1} of the fence is left out: it does not have three places on earth for corners.`);
      continue;
    }
    const inclusion = json['inclusion'] !== false;
    shapes.push({ shape: 'polygon', id: id++, inclusion, group: 0, frame: FRAME.GLOBAL, corners: corners as Spot[] });
  }
  for (const [at, json] of objectsIn(geoFence['circles']).entries()) {
    const circle = isObject(json['circle']) ? json['circle'] : {};
    const centre = latLonOf(circle['center']);
    const radiusM = float32Of(circle['radius']);
    if (!centre || radiusM === null || radiusM <= 0) {
      dropped.push(`Circle ${at + 1} of the fence is left out: it has no centre on earth or no radius.`);
      continue;
    }
    const inclusion = json['inclusion'] !== false;
    shapes.push({ shape: 'circle', id: id++, inclusion, group: 0, frame: FRAME.GLOBAL, centre, radiusM });
  }
  const breach = geoFence['breachReturn'];
  const spot = latLonOf(breach);
  const heightM = Array.isArray(breach) ? (float32Of(breach[2]) ?? 0) : 0;
  return { shapes, returnPoint: spot && { frame: FRAME.GLOBAL_RELATIVE_ALT, spot, heightM } };
}

function rallyOf(rallyPoints: unknown, dropped: string[], nextId: number): RallyPoint[] {
  const points = isObject(rallyPoints) && Array.isArray(rallyPoints['points']) ? rallyPoints['points'] : [];
  const rally: RallyPoint[] = [];
  for (const [at, json] of points.entries()) {
    const spot = latLonOf(json);
    const heightM = Array.isArray(json) ? float32Of(json[2]) : null;
    if (spot && heightM !== null) {
      rally.push({ id: nextId + rally.length, frame: FRAME.GLOBAL_RELATIVE_ALT, spot, heightM });
    } else {
      dropped.push(`Rally point ${at + 1} is left out: it is not a place on earth with a height.`);
    }
  }
  return rally;
}

function homeOf(json: unknown): PlannedHome | null {
  const spot = latLonOf(json);
  if (!spot || (spot.latE7 === 0 && spot.lonE7 === 0)) return null;
  return { spot, altM: Array.isArray(json) ? (float32Of(json[2]) ?? 0) : 0 };
}

export function readQgcPlan(json: unknown, settings: ReadSettings): ReadFile {
  if (!looksLikeQgcPlan(json))
    throw new NotAPlanFile('This is not a plan of QGroundControl: its "fileType" is not "Plan".');
  const { mission } = json;
  if (json['version'] !== 1 || !isObject(mission)) {
    throw new NotAPlanFile('This plan of QGroundControl is not of version 1, or has no mission: it cannot be read.');
  }
  if (mission['version'] !== undefined && mission['version'] !== 2) {
    throw new NotAPlanFile(
      'The mission of this plan is of a version other than 2: save it again with a newer QGroundControl.',
    );
  }
  const dropped: string[] = [];
  let nextId = 1;
  const items = missionOf(mission, dropped, nextId);
  nextId += items.length;
  const fence = fenceOf(json['geoFence'], dropped, nextId);
  nextId += fence.shapes.length;
  const rally = rallyOf(json['rallyPoints'], dropped, nextId);
  nextId += rally.length;
  const speed = mission['hoverSpeed'];
  const defaults = isNumber(speed) && speed > 0 ? { ...settings.defaults, speedMS: speed } : settings.defaults;
  const plan: Plan = {
    ...EMPTY_PLAN,
    defaults,
    items,
    fence,
    rally,
    home: homeOf(mission['plannedHomePosition']),
    nextId,
  };
  return { format: 'QGroundControl plan', plan, areas: [], dropped };
}

const latLon = (spot: Spot): [number, number] => [latDegOf(spot), lonDegOf(spot)];

function itemJson(item: PlanItem, seq: number, jumpIdOf: ReadonlyMap<number, number>): JsonObject {
  const scaled = isScaled(item.command, item.frame);
  const [p1, p2, p3, p4] = item.params.map((value) => (value === null ? null : shortFloat(value)));
  const jumpId = item.jumpTo === null ? undefined : jumpIdOf.get(item.jumpTo);
  return {
    autoContinue: item.autocontinue !== 0,
    command: item.command,
    doJumpId: seq + 1,
    frame: item.frame,
    params: [jumpId ?? p1, p2, p3, p4, axisInFile(item.x, scaled), axisInFile(item.y, scaled), shortFloat(item.z)],
    type: 'SimpleItem',
  };
}

/** `autopilot`: for which one QGroundControl shall take the plan. */
export function writeQgcPlan(plan: Plan, autopilot: keyof typeof FIRMWARE = 'ardupilot'): WrittenFile {
  const dropped: string[] = [];
  const { shapes, returnPoint } = plan.fence;
  if (shapes.some((shape) => shape.group !== 0)) dropped.push('The groups of the fence: QGroundControl has none.');
  if (plan.rally.some((point) => point.frame !== FRAME.GLOBAL_RELATIVE_ALT)) {
    dropped.push('What the heights of rally points are measured from: QGroundControl takes them from home.');
  }
  if (!plan.home) dropped.push('The plan has no home: the file says 0, 0 in its place.');
  const jumpIdOf = new Map(plan.items.map((item, seq) => [item.id, seq + 1]));
  const json = {
    fileType: 'Plan',
    geoFence: {
      ...(returnPoint && { breachReturn: [...latLon(returnPoint.spot), shortFloat(returnPoint.heightM)] }),
      circles: shapes.flatMap((one) =>
        one.shape === 'circle'
          ? [
              {
                circle: { center: latLon(one.centre), radius: shortFloat(one.radiusM) },
                inclusion: one.inclusion,
                version: 1,
              },
            ]
          : [],
      ),
      polygons: shapes.flatMap((one) =>
        one.shape === 'polygon' ? [{ inclusion: one.inclusion, polygon: one.corners.map(latLon), version: 1 }] : [],
      ),
      version: FENCE_VERSION,
    },
    groundStation: 'Control Tower',
    mission: {
      cruiseSpeed: plan.defaults.speedMS,
      firmwareType: FIRMWARE[autopilot],
      globalPlanAltitudeMode: 1,
      hoverSpeed: plan.defaults.speedMS,
      items: plan.items.map((item, seq) => itemJson(item, seq, jumpIdOf)),
      plannedHomePosition: plan.home ? [...latLon(plan.home.spot), shortFloat(plan.home.altM)] : [0, 0, 0],
      vehicleType: QUADROTOR,
      version: 2,
    },
    rallyPoints: { points: plan.rally.map((one) => [...latLon(one.spot), shortFloat(one.heightM)]), version: 2 },
    version: 1,
  };
  return { text: `${JSON.stringify(json, null, 2)}\n`, dropped };
}
