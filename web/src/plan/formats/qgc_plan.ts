/**
 * QGroundControl's files: JSON with mission (qgc_mission.ts), geoFence and rallyPoints in a `.plan`, and in separate
 * files before 2017 (`.mission`, `.fence`, `.rally`). Mission Planner also writes the first form of `.mission`. Jumps
 * refer to an item's `doJumpId`, not its index.
 */

import { t } from '../../languages/text';
import { FAMILIES, USUAL_FAMILY } from '../../link/generated/autopilots.gen';
import type { AutopilotKind } from '../catalogue';
import { FRAME } from '../frames';
import {
  EMPTY_PLAN,
  latDegOf,
  lonDegOf,
  type FenceShape,
  type Plan,
  type PlanItem,
  type RallyPoint,
  type Spot,
} from '../plan_types';
import { isNumber, isObject, latLonOf, objectsIn, type JsonObject } from './json_values';
import {
  axisInFile,
  float32Of,
  isScaled,
  NotAPlanFile,
  shortFloat,
  type ReadFile,
  type ReadSettings,
  type WrittenFile,
} from './plan_file';
import { readMission } from './qgc_mission';

/** MAV_TYPE of the file's header, which also has MAV_AUTOPILOT: QGroundControl requires them; the items are the same. */
const QUADROTOR = 2;
const FENCE_VERSION = 2;

interface Parts {
  readonly mission: JsonObject;
  readonly geoFence: unknown;
  readonly rallyPoints: unknown;
}

/** The three parts, from any of the file types; null if it is none of them. */
function partsOf(json: unknown): Parts | null {
  if (!isObject(json)) return null;
  const { fileType, mission, geoFence, rallyPoints } = json;
  const none = { items: [] };
  if (fileType === 'GeoFence') return { mission: none, geoFence: json, rallyPoints: null };
  if (fileType === 'RallyPoints') return { mission: none, geoFence: null, rallyPoints: json };
  const isFirstForm = fileType === undefined && Array.isArray(json['items']) && 'plannedHomePosition' in json;
  if (fileType === 'Mission' || isFirstForm) return { mission: json, geoFence: null, rallyPoints: null };
  if (fileType === 'Plan' || (isObject(mission) && Array.isArray(mission['items']))) {
    return { mission: isObject(mission) ? mission : {}, geoFence, rallyPoints };
  }
  return null;
}

export const looksLikeQgcPlan = (json: unknown): json is JsonObject => partsOf(json) !== null;

/** Before 2017 there was one border, which ArduPilot treated as an inclusion area; the rest was parameters. */
function firstFenceOf(geoFence: JsonObject, dropped: string[], id: number): FenceShape[] {
  if (objectsIn(geoFence['parameters']).length > 0) {
    dropped.push(t('The parameters of the fence (circle, heights, what happens) are left out: set them on the drone.'));
  }
  const json = Array.isArray(geoFence['polygon']) ? geoFence['polygon'] : [];
  if (json.length === 0) return [];
  const corners = json.map(latLonOf);
  if (corners.length < 3 || corners.includes(null)) {
    dropped.push(t('The border of the fence is left out: it does not have three places on earth for corners.'));
    return [];
  }
  dropped.push(t('The fence is of version 1: its border was taken as one to stay inside of.'));
  return [{ shape: 'polygon', id, inclusion: true, group: 0, frame: FRAME.GLOBAL, corners: corners as Spot[] }];
}

function shapesOf(geoFence: JsonObject, dropped: string[], nextId: number): FenceShape[] {
  const shapes: FenceShape[] = [];
  let id = nextId;
  for (const [at, json] of objectsIn(geoFence['polygons']).entries()) {
    const corners = Array.isArray(json['polygon']) ? json['polygon'].map(latLonOf) : [];
    if (corners.length < 3 || corners.includes(null)) {
      dropped.push(
        t('Polygon {at} of the fence is left out: it does not have three places on earth for corners.', { at: at + 1 }),
      );
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
      dropped.push(t('Circle {at} of the fence is left out: it has no centre on earth or no radius.', { at: at + 1 }));
      continue;
    }
    const inclusion = json['inclusion'] !== false;
    shapes.push({ shape: 'circle', id: id++, inclusion, group: 0, frame: FRAME.GLOBAL, centre, radiusM });
  }
  return shapes;
}

function fenceOf(geoFence: unknown, dropped: string[], nextId: number): Plan['fence'] {
  if (!isObject(geoFence)) return { shapes: [], returnPoint: null };
  const isFirst = !('polygons' in geoFence) && !('circles' in geoFence);
  const version = geoFence['version'] ?? FENCE_VERSION;
  if (version !== 1 && version !== FENCE_VERSION) {
    dropped.push(t('The fence is left out: it is of a version that is not known here. Draw it again.'));
    return { shapes: [], returnPoint: null };
  }
  const shapes = isFirst ? firstFenceOf(geoFence, dropped, nextId) : shapesOf(geoFence, dropped, nextId);
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
      dropped.push(t('Rally point {at} is left out: it is not a place on earth with a height.', { at: at + 1 }));
    }
  }
  return rally;
}

export function readQgcPlan(json: unknown, settings: ReadSettings): ReadFile {
  const parts = partsOf(json);
  if (!parts || !isObject(json)) {
    throw new NotAPlanFile(t('This is not a plan of QGroundControl: its "fileType" is not "Plan".'));
  }
  const { mission } = parts;
  if (json['fileType'] === 'Plan' && (json['version'] !== 1 || !isObject(json['mission']))) {
    throw new NotAPlanFile(t('This plan of QGroundControl is not of version 1, or has no mission: it cannot be read.'));
  }
  const version = mission['version'] ?? 2;
  if (!/^[12](\.0)?$/.test(`${version}`)) {
    throw new NotAPlanFile(
      t('The mission of this plan is of a version other than 1 and 2: save it again with another QGroundControl.'),
    );
  }
  const dropped: string[] = [];
  const read = readMission(mission, dropped, 1);
  let nextId = 1 + read.items.length;
  const fence = fenceOf(parts.geoFence, dropped, nextId);
  nextId += fence.shapes.length;
  const rally = rallyOf(parts.rallyPoints, dropped, nextId);
  nextId += rally.length;
  const speed = mission['hoverSpeed'];
  const defaults = isNumber(speed) && speed > 0 ? { ...settings.defaults, speedMS: speed } : settings.defaults;
  const plan: Plan = { ...EMPTY_PLAN, defaults, items: read.items, fence, rally, home: read.home, nextId };
  const areas = read.areas.map((corners) => ({ name: '', corners, holes: [] }));
  return { format: 'QGroundControl plan', plan, areas, dropped };
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

/** `autopilot`: the one that QGroundControl assumes for the plan. */
export function writeQgcPlan(plan: Plan, autopilot: AutopilotKind = USUAL_FAMILY): WrittenFile {
  const dropped: string[] = [];
  const { shapes, returnPoint } = plan.fence;
  if (shapes.some((shape) => shape.group !== 0)) dropped.push(t('The groups of the fence: QGroundControl has none.'));
  if (plan.rally.some((point) => point.frame !== FRAME.GLOBAL_RELATIVE_ALT)) {
    dropped.push(t('What the heights of rally points are measured from: QGroundControl takes them from home.'));
  }
  if (!plan.home) dropped.push(t('The plan has no home: the file says 0, 0 in its place.'));
  const jumpIdOf = new Map(plan.items.map((item, seq) => [item.id, seq + 1]));
  const json = {
    fileType: t('Plan'),
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
      firmwareType: FAMILIES[autopilot].autopilot,
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
