/**
 * Reads and writes GeoJSON (RFC 7946). Our own files carry each part of the plan in the property `control_tower` and
 * return unchanged. The user decides what the points, lines and outlines of other files mean.
 */

import { t } from '../../languages/text';
import { commandWords } from '../catalogue';
import { frameWords } from '../frames';
import {
  degOf,
  EMPTY_PLAN,
  latDegOf,
  lonDegOf,
  type FenceShape,
  type Plan,
  type RallyPoint,
  type Spot,
  type WireItem,
} from '../plan_types';
import { itemOfRow, missionItems, planItems, rowOf } from '../wire_items';
import { ShapeFinder } from './found_shapes';
import { isNumber, isObject, placeOf, type JsonObject } from './json_values';
import {
  float32Of,
  heldToMost,
  isScaled,
  NotAPlanFile,
  shortFloat,
  type ReadFile,
  type ReadSettings,
  type WrittenFile,
} from './plan_file';

/** The property for what only this console understands. */
export const OWN = 'control_tower';

const GEOMETRIES = [
  'Point',
  'MultiPoint',
  'LineString',
  'MultiLineString',
  'Polygon',
  'MultiPolygon',
  'GeometryCollection',
];

export const looksLikeGeoJson = (json: unknown): json is JsonObject =>
  isObject(json) && ['FeatureCollection', 'Feature', ...GEOMETRIES].includes(`${json['type']}`);

/** In KML the property is text. */
function ownOf(feature: JsonObject): JsonObject | null {
  const properties = feature['properties'];
  const own = isObject(properties) ? properties[OWN] : undefined;
  if (isObject(own)) return own;
  if (typeof own !== 'string') return null;
  try {
    const json: unknown = JSON.parse(own);
    return isObject(json) ? json : null;
  } catch {
    return null;
  }
}

interface Own {
  readonly items: WireItem[];
  readonly shapes: FenceShape[];
  readonly rally: RallyPoint[];
  home: Plan['home'];
  returnPoint: Plan['fence']['returnPoint'];
}

const firstPlace = (geometry: unknown): Spot | null => {
  const at = isObject(geometry) && geometry['type'] === 'Point' ? geometry['coordinates'] : null;
  return Array.isArray(at) ? placeOf(at[1], at[0]) : null;
};

/** Returns false if it is not a valid part of a plan. */
function takeOwn(own: JsonObject, geometry: unknown, into: Own): boolean {
  const spot = firstPlace(geometry);
  const frame = Number.isInteger(own['frame']) ? (own['frame'] as number) : null;
  const heightM = float32Of(own['height_m']);
  if (own['part'] === 'item') {
    const item = itemOfRow(own['item'], t('Item {items}', { items: into.items.length + 1 }));
    // The point may have been moved in another program; the rest of the item is in the property.
    const isPlaced = spot && isScaled(item.command, item.frame);
    into.items.push(isPlaced ? { ...item, x: spot.latE7, y: spot.lonE7 } : item);
    return true;
  }
  if (own['part'] === 'path') return true;
  if (own['part'] === 'home' && spot && heightM !== null) {
    into.home = { spot, altM: heightM };
    return true;
  }
  if (frame === null) return false;
  const common = {
    id: 0,
    frame,
    inclusion: own['inclusion'] !== false,
    group: isNumber(own['group']) ? own['group'] : 0,
  };
  if (own['part'] === 'fence-circle' && spot && isNumber(own['radius_m'])) {
    into.shapes.push({ shape: 'circle', ...common, centre: spot, radiusM: Math.fround(own['radius_m']) });
    return true;
  }
  if (own['part'] === 'fence-polygon') {
    const found = new ShapeFinder();
    found.take(geometry, '');
    const [area] = found.areas;
    if (area) into.shapes.push({ shape: 'polygon', ...common, corners: area.corners });
    return area !== undefined;
  }
  if (own['part'] === 'fence-return' && spot && heightM !== null) {
    into.returnPoint = { frame, spot, heightM };
    return true;
  }
  if (own['part'] === 'rally' && spot && heightM !== null) {
    into.rally.push({ id: 0, frame, spot, heightM });
    return true;
  }
  return false;
}

function featuresOf(json: JsonObject): JsonObject[] {
  if (json['type'] === 'FeatureCollection') {
    if (!Array.isArray(json['features'])) throw new NotAPlanFile(t('This GeoJSON has no list of features.'));
    return json['features'].filter(isObject);
  }
  return [json['type'] === 'Feature' ? json : { type: 'Feature', properties: {}, geometry: json }];
}

const nameOf = (feature: JsonObject): string => {
  const properties = feature['properties'];
  const name = isObject(properties) ? (properties['name'] ?? properties['title']) : undefined;
  return typeof name === 'string' ? name : '';
};

export function readGeoJson(json: unknown, settings: ReadSettings): ReadFile {
  if (!looksLikeGeoJson(json)) throw new NotAPlanFile(t('This is not GeoJSON: it has no features and no shapes.'));
  // Degrees are the rule; older files may name another system, and would be misplaced.
  const crs = json['crs'] === undefined ? '' : JSON.stringify(json['crs']);
  if (crs !== '' && !/CRS84|4326/.test(crs)) {
    throw new NotAPlanFile(t('This GeoJSON is not in degrees (WGS 84): save it again in that coordinate system.'));
  }
  return readFeatures(featuresOf(json), settings, 'GeoJSON');
}

/** Features as GeoJSON has them, whatever the file was. */
export function readFeatures(
  features: readonly JsonObject[],
  settings: ReadSettings,
  format: ReadFile['format'],
): ReadFile {
  const found = new ShapeFinder();
  const own: Own = { items: [], shapes: [], rally: [], home: null, returnPoint: null };
  for (const feature of features) {
    const part = ownOf(feature);
    if (!part) found.take(feature['geometry'], nameOf(feature));
    else if (!takeOwn(part, feature['geometry'], own)) {
      found.leave(t('A part of the plan in this file is damaged and left out.'));
    }
  }
  heldToMost(own.items.length, t('waypoints'));
  let nextId = own.items.length + 1;
  const shapes = own.shapes.map((shape): FenceShape => ({ ...shape, id: nextId++ }));
  const rally = own.rally.map((point): RallyPoint => ({ ...point, id: nextId++ }));
  const plan: Plan = {
    ...EMPTY_PLAN,
    defaults: settings.defaults,
    home: own.home,
    items: planItems(own.items, 1),
    fence: { shapes, returnPoint: own.returnPoint },
    rally,
    nextId,
  };
  const { routes, marks, areas, left, assumed } = found;
  return { format, plan, routes, marks, areas, dropped: left, assumed };
}

type Position = readonly [number, number];
export type PartGeometry =
  | { readonly type: 'Point'; readonly coordinates: Position }
  | { readonly type: 'LineString'; readonly coordinates: readonly Position[] }
  | { readonly type: 'Polygon'; readonly coordinates: readonly (readonly Position[])[] };

export interface PartFeature {
  readonly type: 'Feature';
  readonly geometry: PartGeometry | null;
  readonly properties: { readonly name: string; readonly [OWN]: JsonObject };
}

const at = (spot: Spot): Position => [lonDegOf(spot), latDegOf(spot)];
const point = (spot: Spot): PartGeometry => ({ type: 'Point', coordinates: at(spot) });
const feature = (name: string, geometry: PartGeometry | null, own: JsonObject): PartFeature => ({
  type: 'Feature',
  geometry,
  properties: { name, [OWN]: own },
});

function itemFeature(item: WireItem, seq: number): PartFeature {
  const spot = { latE7: item.x, lonE7: item.y };
  const isPlaced = isScaled(item.command, item.frame) && (item.x !== 0 || item.y !== 0);
  const name = `${seq + 1} ${commandWords(item.command)}`;
  const height = isPlaced ? `, ${shortFloat(item.z)} m ${frameWords(item.frame)}` : '';
  return feature(name + height, isPlaced ? point(spot) : null, { part: 'item', item: rowOf(item) });
}

function shapeFeature(shape: FenceShape): PartFeature {
  const { inclusion, group, frame } = shape;
  const name = inclusion ? t('Fence: stay inside') : t('Fence: stay outside');
  const own = { inclusion, group, frame };
  if (shape.shape === 'circle') {
    return feature(name, point(shape.centre), { part: 'fence-circle', ...own, radius_m: shape.radiusM });
  }
  const ring = [...shape.corners, ...shape.corners.slice(0, 1)].map(at);
  return feature(name, { type: 'Polygon', coordinates: [ring] }, { part: 'fence-polygon', ...own });
}

/** The parts of a plan as features, in the order of reading. */
export function planFeatures(plan: Plan): PartFeature[] {
  const items = missionItems(plan);
  const path = items
    .filter((item) => item.command < 95 && isScaled(item.command, item.frame) && (item.x !== 0 || item.y !== 0))
    .map((item): Position => [degOf(item.y), degOf(item.x)]);
  const { shapes, returnPoint } = plan.fence;
  return [
    ...(plan.home
      ? [feature(t('Planned home'), point(plan.home.spot), { part: 'home', height_m: plan.home.altM })]
      : []),
    ...items.map(itemFeature),
    ...(path.length > 1 ? [feature(t('Path'), { type: 'LineString', coordinates: path }, { part: 'path' })] : []),
    ...shapes.map(shapeFeature),
    ...(returnPoint
      ? [
          feature(t('Fence: return to'), point(returnPoint.spot), {
            part: 'fence-return',
            frame: returnPoint.frame,
            height_m: returnPoint.heightM,
          }),
        ]
      : []),
    ...plan.rally.map((one) =>
      feature(t('Rally point'), point(one.spot), { part: 'rally', frame: one.frame, height_m: one.heightM }),
    ),
  ];
}

export function writeGeoJson(plan: Plan): WrittenFile {
  const json = { type: 'FeatureCollection', features: planFeatures(plan) };
  return { text: `${JSON.stringify(json, null, 1)}\n`, dropped: [] };
}
