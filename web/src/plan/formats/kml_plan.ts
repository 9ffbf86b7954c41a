/**
 * KML, as Google Earth reads and writes it. Reads through GeoJSON (@tmcw/togeojson); writes the small subset itself.
 */

import { kml } from '@tmcw/togeojson';

import { t } from '../../languages/text';
import type { Plan } from '../plan_types';
import { OWN, planFeatures, readGeoJson, type PartGeometry } from './geojson_plan';
import { NotAPlanFile, type ReadFile, type ReadSettings, type WrittenFile } from './plan_file';

/** The browser's DOMParser, or an equivalent. Throws, or makes a `parsererror`, if the text is not XML. */
export type ParseXml = (text: string) => Document;

export const looksLikeXml = (text: string): boolean => text.startsWith('<');

export function readKml(text: string, settings: ReadSettings, parseXml: ParseXml): ReadFile {
  let document: Document;
  try {
    document = parseXml(text);
  } catch {
    throw new NotAPlanFile(t('This file is not whole: its XML cannot be read.'));
  }
  const root = document.documentElement as Element | null;
  if (!root || document.getElementsByTagName('parsererror').length > 0) {
    throw new NotAPlanFile(t('This file is not whole: its XML cannot be read.'));
  }
  if (root.localName !== 'kml') {
    throw new NotAPlanFile(
      t('This is XML, but not KML: it begins with "{localName}".', { localName: `${root.localName}`.slice(0, 40) }),
    );
  }
  const links = document.getElementsByTagName('NetworkLink').length;
  const overlays = document.getElementsByTagName('GroundOverlay').length;
  const read = readGeoJson(withoutOverlays(kml(document)), settings, 'KML');
  const dropped = [...read.dropped];
  if (links > 0) dropped.push(t('What the file only links to is left out: save it from there.'));
  if (overlays > 0) dropped.push(t('Pictures laid over the map are left out.'));
  return { ...read, dropped };
}

/** Overlays and links arrive as outlines of their coverage. */
const COVERS: ReadonlySet<unknown> = new Set(['groundoverlay', 'networklink']);

const withoutOverlays = (collection: ReturnType<typeof kml>): ReturnType<typeof kml> => ({
  ...collection,
  features: collection.features.filter((one) => !COVERS.has(one.properties?.['@geometry-type'])),
});

const SIGNS: Readonly<Record<string, string>> = { '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' };
const escaped = (text: string): string => text.replace(/[&<>"]/g, (sign) => SIGNS[sign]!);

const tuples = (positions: readonly (readonly [number, number])[]): string =>
  `<coordinates>${positions.map(([lon, lat]) => `${lon},${lat}`).join(' ')}</coordinates>`;

function geometryXml(geometry: PartGeometry): string {
  switch (geometry.type) {
    case 'Point':
      return `<Point>${tuples([geometry.coordinates])}</Point>`;
    case 'LineString':
      return `<LineString><tessellate>1</tessellate>${tuples(geometry.coordinates)}</LineString>`;
    case 'Polygon': {
      const [ring = []] = geometry.coordinates;
      return `<Polygon><outerBoundaryIs><LinearRing>${tuples(ring)}</LinearRing></outerBoundaryIs></Polygon>`;
    }
  }
}

export function writeKml(plan: Plan, name: string): WrittenFile {
  const marks = planFeatures(plan).map(({ geometry, properties }) =>
    [
      '<Placemark>',
      `<name>${escaped(properties.name)}</name>`,
      t('<ExtendedData><Data name="{own}"><value>{escaped}</value></Data></ExtendedData>', {
        own: OWN,
        escaped: escaped(JSON.stringify(properties[OWN])),
      }),
      geometry ? geometryXml(geometry) : '',
      '</Placemark>',
    ].join(''),
  );
  const head = '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2">\n<Document>\n';
  const text = `${head}<name>${escaped(name)}</name>\n${marks.join('\n')}\n</Document>\n</kml>\n`;
  const dropped = [
    t('Heights are in the data of each part, not in the drawing: Google Earth shows the plan on the ground.'),
  ];
  return { text, dropped: plan.items.length + plan.rally.length > 0 ? dropped : [] };
}
