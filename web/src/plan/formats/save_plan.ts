/** The file formats of a plan: names, extensions, and what each omits, in words. */

import { t } from '../../languages/text';
import type { AutopilotKind } from '../catalogue';
import { documentOf } from '../plan_document';
import type { Plan } from '../plan_types';
import { writeGeoJson } from './geojson_plan';
import { writeKml } from './kml_plan';
import type { WrittenFile } from './plan_file';
import { writeQgcPlan } from './qgc_plan';
import { writeWaypoints } from './waypoint_file';

export type SaveFormat = 'plan' | 'waypoints' | 'geojson' | 'kml' | 'json';

export const SAVE_FORMATS: readonly { readonly format: SaveFormat; readonly label: string }[] = [
  { format: 'plan', label: t('QGroundControl (.plan)') },
  { format: 'waypoints', label: t('Mission Planner (.waypoints)') },
  { format: 'geojson', label: t('GeoJSON (.geojson)') },
  { format: 'kml', label: t('KML (.kml)') },
  { format: 'json', label: t('Control Tower (.json)') },
];

export interface NamedFile extends WrittenFile {
  readonly name: string;
}

/** A valid file name from what people type. */
const fileName = (name: string): string => name.replaceAll(/[^\p{L}\p{N}._-]+/gu, ' ').trim() || 'plan';

export function savePlan(plan: Plan, name: string, format: SaveFormat, autopilot: AutopilotKind): NamedFile {
  const called = `${fileName(name)}.${format}`;
  switch (format) {
    case 'plan':
      return { name: called, ...writeQgcPlan(plan, autopilot) };
    case 'waypoints':
      return { name: called, ...writeWaypoints(plan) };
    case 'geojson':
      return { name: called, ...writeGeoJson(plan) };
    case 'kml':
      return { name: called, ...writeKml(plan, fileName(name)) };
    case 'json':
      return { name: called, text: JSON.stringify(documentOf(plan)), dropped: [] };
  }
}

/** The name of a file without its extension. */
export const planName = (file: string): string => file.replace(/\.[^.]{1,12}$/, '');
