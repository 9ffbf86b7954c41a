/** Opens a plan file of any format: recognised by its content, not its name. */

import { t } from '../../languages/text';
import { planOfDocument } from '../plan_document';
import { looksLikeGeoJson, readGeoJson } from './geojson_plan';
import { isObject } from './json_values';
import { readGpx } from './gpx_plan';
import { readKml } from './kml_plan';
import { NotAPlanFile, type ReadFile, type ReadSettings } from './plan_file';
import { looksLikePoints, readPoints } from './point_file';
import { looksLikeQgcPlan, readQgcPlan } from './qgc_plan';
import { looksLikeWaypoints, readWaypoints } from './waypoint_file';
import { looksLikeXml, rootOf, type ParseXml } from './xml';

/** A plan of 700 items is 300 kB in the most verbose format; hand-drawn maps stay far below this. */
export const MAX_LENGTH = 8_000_000;

const KINDS = t(
  'Open a .plan or .mission of QGroundControl, a .waypoints, .fen, .ral or .poly of Mission Planner or MAVProxy, GeoJSON, KML, KMZ, GPX, a shapefile (.zip), a table of places (.csv), or a plan saved here.',
);

function readJson(text: string, settings: ReadSettings): ReadFile {
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch {
    throw new NotAPlanFile(t('This file is not whole: its JSON cannot be read.'));
  }
  if (looksLikeQgcPlan(json)) return readQgcPlan(json, settings);
  if (looksLikeGeoJson(json)) return readGeoJson(json, settings);
  if (isObject(json) && Array.isArray(json['mission'])) {
    return { format: 'saved plan', areas: [], ...planOfDocument(json) };
  }
  const fileType = isObject(json) ? json['fileType'] : undefined;
  if (typeof fileType === 'string') {
    throw new NotAPlanFile(
      t('This is a file of QGroundControl for "{fileType}", not a plan. {kinds}', {
        fileType: fileType.slice(0, 40),
        kinds: KINDS,
      }),
    );
  }
  throw new NotAPlanFile(t('This JSON is no plan. {kinds}', { kinds: KINDS }));
}

function readXml(text: string, settings: ReadSettings, parseXml: ParseXml): ReadFile {
  const root = rootOf(text, parseXml);
  if (root.localName === 'kml') return readKml(root, settings);
  if (root.localName === 'gpx') return readGpx(root, settings);
  throw new NotAPlanFile(
    t('This is XML, but neither KML nor GPX: it begins with "{localName}".', {
      localName: root.localName.slice(0, 40),
    }),
  );
}

function readBody(body: string, settings: ReadSettings, parseXml: ParseXml): ReadFile {
  if (body === '') throw new NotAPlanFile(t('This file is empty.'));
  if (looksLikeWaypoints(body)) return readWaypoints(body, settings);
  if (body.startsWith('{') || body.startsWith('[')) return readJson(body, settings);
  if (looksLikeXml(body)) return readXml(body, settings, parseXml);
  if (looksLikePoints(body)) return readPoints(body, settings);
  throw new NotAPlanFile(t('This file is no plan. {kinds}', { kinds: KINDS }));
}

const isNothing = ({ plan, areas, routes = [], marks = [] }: ReadFile): boolean =>
  [plan.items, plan.fence.shapes, plan.rally, areas, routes, marks].every((list) => list.length === 0) &&
  plan.fence.returnPoint === null;

/** Finding nothing is a failure: nothing never replaces a plan. */
export function notNothing(read: ReadFile): ReadFile {
  if (!isNothing(read)) return read;
  throw new NotAPlanFile([t('There is nothing to fly in this file.'), ...read.dropped].join(' '));
}

/** Throws only NotAPlanFile, with a message for people, whatever the text. */
export function openPlanFile(text: string, settings: ReadSettings, parseXml: ParseXml): ReadFile {
  if (text.length > MAX_LENGTH) throw new NotAPlanFile(t('This file is too large to be a plan.'));
  try {
    return notNothing(readBody(text.replace(/^\uFEFF/, '').trimStart(), settings, parseXml));
  } catch (error) {
    if (error instanceof RangeError) throw new NotAPlanFile(error.message);
    throw error;
  }
}
