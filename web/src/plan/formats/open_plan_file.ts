/** Opens a plan file of any format: recognised by its content, not its name. */

import { t } from '../../languages/text';
import { planOfDocument } from '../plan_document';
import { looksLikeGeoJson, readGeoJson } from './geojson_plan';
import { isObject } from './json_values';
import { looksLikeXml, readKml, type ParseXml } from './kml_plan';
import { NotAPlanFile, type ReadFile, type ReadSettings } from './plan_file';
import { looksLikePoints, readPoints } from './point_file';
import { looksLikeQgcPlan, readQgcPlan } from './qgc_plan';
import { looksLikeWaypoints, readWaypoints } from './waypoint_file';

/** A plan of 700 items is 300 kB in the most verbose format; hand-drawn maps stay far below this. */
export const MAX_LENGTH = 8_000_000;

const KINDS = t(
  'Open a .plan or .mission of QGroundControl, a .waypoints, .fen, .ral or .poly of Mission Planner or MAVProxy, GeoJSON, KML, or a plan saved here.',
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

/** Throws only NotAPlanFile, with a message for people, whatever the file. */
export function openPlanFile(text: string, settings: ReadSettings, parseXml: ParseXml): ReadFile {
  if (text.length > MAX_LENGTH) throw new NotAPlanFile(t('This file is too large to be a plan.'));
  const body = text.replace(/^\uFEFF/, '').trimStart();
  try {
    if (body === '') throw new NotAPlanFile(t('This file is empty.'));
    if (looksLikeWaypoints(body)) return readWaypoints(body, settings);
    if (body.startsWith('{') || body.startsWith('[')) return readJson(body, settings);
    if (looksLikeXml(body)) return readKml(body, settings, parseXml);
    if (looksLikePoints(body)) return readPoints(body, settings);
  } catch (error) {
    if (error instanceof RangeError) throw new NotAPlanFile(error.message);
    throw error;
  }
  if (body.startsWith('PK'))
    throw new NotAPlanFile(t('This is a packed file (.kmz or .zip): unpack it, and open the .kml in it.'));
  throw new NotAPlanFile(t('This file is no plan. {kinds}', { kinds: KINDS }));
}
