/**
 * Reads and writes GeoJSON (RFC 7946). Our own files carry each part of the plan in the property `control_tower` and
 * return unchanged. In other files, points and lines become waypoints at the plan's default height; the user decides
 * what outlines mean.
 */

import { plural, t } from '../../languages/text';
import { CMD, commandWords } from '../catalogue';
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
import { itemOfRow, missionItems, planItems, rowOf, wireItem } from '../wire_items';
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

interface Shapes {
  readonly points: Spot[];
  readonly areas: Spot[][];
  readonly dropped: string[];
  heights: number;
  holes: number;
  outside: number;
}

function spotsOf(coordinates: unknown, found: Shapes): Spot[] {
  if (!Array.isArray(coordinates)) throw new NotAPlanFile(t('A shape in this file has no coordinates.'));
  return coordinates.flatMap((one: unknown) => {
    const spot = Array.isArray(one) ? placeOf(one[1], one[0]) : null;
    if (!spot) {
      found.outside += 1;
      return [];
    }
    if (isNumber((one as unknown[])[2])) found.heights += 1;
    return [spot];
  });
}

const isSame = (one: Spot, other: Spot): boolean => one.latE7 === other.latE7 && one.lonE7 === other.lonE7;

function takePolygon(rings: unknown, found: Shapes): void {
  if (!Array.isArray(rings) || rings.length === 0) throw new NotAPlanFile(t('An outline in this file has no corners.'));
  const ring = spotsOf(rings[0], found);
  found.holes += rings.length - 1;
  const isClosed = ring.length > 1 && isSame(ring[0]!, ring.at(-1)!);
  const corners = isClosed ? ring.slice(0, -1) : ring;
  if (corners.length >= 3) found.areas.push(corners);
  else found.dropped.push(t('An outline with fewer than three corners is left out.'));
}

const listOf = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);

/** GeometryCollections nest; real files do not go deeper than this. */
const DEEPEST = 8;

function takeGeometry(geometry: unknown, found: Shapes, depth = 0): void {
  if (geometry === null || geometry === undefined) return;
  if (!isObject(geometry)) throw new NotAPlanFile(t('A feature in this file has no shape.'));
  const { type, coordinates } = geometry;
  if (type === 'Point') found.points.push(...spotsOf([coordinates], found));
  else if (type === 'MultiPoint' || type === 'LineString') found.points.push(...spotsOf(coordinates, found));
  else if (type === 'MultiLineString') for (const one of listOf(coordinates)) found.points.push(...spotsOf(one, found));
  else if (type === 'Polygon') takePolygon(coordinates, found);
  else if (type === 'MultiPolygon') for (const one of listOf(coordinates)) takePolygon(one, found);
  else if (type === 'GeometryCollection' && depth < DEEPEST) {
    for (const one of listOf(geometry['geometries'])) takeGeometry(one, found, depth + 1);
  } else found.dropped.push(t('A shape of the kind "{type}" is left out.', { type: `${type}`.slice(0, 40) }));
}

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
    const found: Shapes = { points: [], areas: [], dropped: [], heights: 0, holes: 0, outside: 0 };
    takeGeometry(geometry, found);
    const [corners] = found.areas;
    if (corners) into.shapes.push({ shape: 'polygon', ...common, corners });
    return corners !== undefined;
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

function dropWords(found: Shapes, heightM: number): string[] {
  const { heights, holes, outside } = found;
  const words = [...found.dropped];
  if (heights > 0) {
    words.push(
      t('The heights in the file were not taken ({counted}): it does not say from where. All are {height} m.', {
        counted: plural(heights, { one: '{n} place', other: '{n} places' }),
        height: heightM,
      }),
    );
  }
  if (holes > 0)
    words.push(
      t('{counted} in outlines left out.', { counted: plural(holes, { one: '{n} hole', other: '{n} holes' }) }),
    );
  if (outside > 0)
    words.push(
      t('{counted} left out: not on earth, latitude and longitude in degrees.', {
        counted: plural(outside, { one: '{n} place', other: '{n} places' }),
      }),
    );
  return words;
}

export function readGeoJson(json: unknown, settings: ReadSettings, format: 'GeoJSON' | 'KML' = 'GeoJSON'): ReadFile {
  if (!looksLikeGeoJson(json)) throw new NotAPlanFile(t('This is not GeoJSON: it has no features and no shapes.'));
  // Degrees are the rule; older files may name another system, and would be misplaced.
  const crs = json['crs'] === undefined ? '' : JSON.stringify(json['crs']);
  if (crs !== '' && !/CRS84|4326/.test(crs)) {
    throw new NotAPlanFile(t('This GeoJSON is not in degrees (WGS 84): save it again in that coordinate system.'));
  }
  const found: Shapes = { points: [], areas: [], dropped: [], heights: 0, holes: 0, outside: 0 };
  const own: Own = { items: [], shapes: [], rally: [], home: null, returnPoint: null };
  for (const feature of featuresOf(json)) {
    const part = ownOf(feature);
    if (part) {
      if (!takeOwn(part, feature['geometry'], own))
        found.dropped.push(t('A part of the plan in this file is damaged and left out.'));
    } else takeGeometry(feature['geometry'], found);
  }
  const { heightM, frame } = settings.defaults;
  const drawn = found.points.map((at) => wireItem(CMD.WAYPOINT, frame, [0, 0, 0, null], at.latE7, at.lonE7, heightM));
  const items = [...own.items, ...drawn];
  heldToMost(items.length, t('waypoints'));
  let nextId = items.length + 1;
  const shapes = own.shapes.map((shape): FenceShape => ({ ...shape, id: nextId++ }));
  const rally = own.rally.map((point): RallyPoint => ({ ...point, id: nextId++ }));
  const plan: Plan = {
    ...EMPTY_PLAN,
    defaults: settings.defaults,
    home: own.home,
    items: planItems(items, 1),
    fence: { shapes, returnPoint: own.returnPoint },
    rally,
    nextId,
  };
  return { format, plan, areas: found.areas, dropped: dropWords(found, heightM) };
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
