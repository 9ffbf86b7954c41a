/**
 * KML, as Google Earth reads and writes it. Reads each Placemark with the `altitudeMode` of each of its shapes; writes a
 * small subset.
 */

import { plural, t } from '../../languages/text';
import { FRAME } from '../frames';
import type { Plan } from '../plan_types';
import { HEIGHTS_FROM } from './found_shapes';
import { OWN, planFeatures, readFeatures, type PartGeometry } from './geojson_plan';
import type { JsonObject } from './json_values';
import type { ReadFile, ReadSettings, WrittenFile } from './plan_file';
import { childrenOf, descendantsOf, textOf } from './xml';

const MODES: ReadonlyMap<string, number> = new Map([
  ['absolute', FRAME.GLOBAL],
  ['relativeToGround', FRAME.GLOBAL_TERRAIN_ALT],
  ['relativeToSeaFloor', FRAME.GLOBAL_TERRAIN_ALT],
]);
const COLLECTION = /^Multi(Geometry|Track)$/;
const SHAPE = /^(Multi(Geometry|Track)|Point|LineString|LinearRing|Polygon|Track)$/;
const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;

type Position = readonly number[];

/** Counts what the coordinates of a file have that cannot be taken. */
class Coordinates {
  unreadable = 0;
  /** Heights of shapes that lie on the ground. */
  onGround = 0;

  /** "longitude,latitude,height" between blanks; people also put blanks behind the commas. */
  read(text: string, isOnGround: boolean): Position[] {
    const strict = text.trim().split(/\s+/).map(tupleOf);
    const all = strict.every((one) => one !== null)
      ? strict
      : text
          .trim()
          .replace(/\s*,\s*/g, ',')
          .split(/\s+/)
          .map(tupleOf);
    return text.trim() === '' ? [] : all.flatMap((one) => this.#taken(one, isOnGround));
  }

  /** "longitude latitude height" of a track. */
  track(texts: readonly string[], isOnGround: boolean): Position[] {
    return texts.flatMap((text) => this.#taken(tupleOf(text.trim().replace(/\s+/g, ',')), isOnGround));
  }

  #taken(position: Position | null, isOnGround: boolean): Position[] {
    if (!position) this.unreadable += 1;
    else if (isOnGround && position[2]) this.onGround += 1;
    return position ? [isOnGround ? position.slice(0, 2) : position] : [];
  }
}

function tupleOf(text: string): Position | null {
  const parts = text.replace(/,$/, '').split(',');
  const isWhole = (parts.length === 2 || parts.length === 3) && parts.every((part) => NUMBER.test(part));
  return isWhole ? parts.map(Number) : null;
}

function geometryOf(shape: Element, into: Coordinates): JsonObject {
  const kind = shape.localName;
  if (COLLECTION.test(kind)) {
    const geometries = childrenOf(shape)
      .filter(({ localName }) => SHAPE.test(localName))
      .map((one) => geometryOf(one, into));
    return { type: 'GeometryCollection', geometries };
  }
  const frame = MODES.get(textOf(shape, 'altitudeMode').trim());
  const isOnGround = frame === undefined;
  const from = isOnGround ? {} : { [HEIGHTS_FROM]: frame };
  const points = (element: Element): Position[] => into.read(textOf(element, 'coordinates'), isOnGround);
  switch (kind) {
    case 'Point':
      return { type: 'MultiPoint', coordinates: points(shape), ...from };
    case 'Polygon': {
      const rings = ['outerBoundaryIs', 'innerBoundaryIs'].flatMap((name) =>
        childrenOf(shape)
          .filter(({ localName }) => localName === name)
          .flatMap((boundary) => childrenOf(boundary).filter(({ localName }) => localName === 'LinearRing')),
      );
      return { type: 'Polygon', coordinates: rings.map(points) };
    }
    case 'Track': {
      const coords = childrenOf(shape).filter(({ localName }) => localName === 'coord');
      const positions = into.track(
        coords.map((one) => one.textContent),
        isOnGround,
      );
      return { type: 'LineString', coordinates: positions, ...from };
    }
    default:
      return { type: 'LineString', coordinates: points(shape), ...from };
  }
}

function ownOf(placemark: Element): string | undefined {
  const data = childrenOf(placemark)
    .filter(({ localName }) => localName === 'ExtendedData')
    .flatMap(childrenOf)
    .find((one) => one.localName === 'Data' && one.getAttribute('name') === OWN);
  return data && textOf(data, 'value');
}

/** Whether a Placemark's shape has a place at all: "Model" and the like have none that could be flown. */
const isShape = ({ localName }: Element): boolean => SHAPE.test(localName) || localName === 'Model';

export function readKml(root: Element, settings: ReadSettings): ReadFile {
  const coordinates = new Coordinates();
  const others = { NetworkLink: 0, overlays: 0 };
  const features: JsonObject[] = [];
  for (const element of descendantsOf(root)) {
    if (element.localName === 'NetworkLink') others.NetworkLink += 1;
    else if (element.localName.endsWith('Overlay')) others.overlays += 1;
    else if (element.localName === 'Placemark') {
      const shape = childrenOf(element).find(isShape);
      const own = ownOf(element);
      const isModel = shape?.localName === 'Model';
      features.push({
        properties: { name: textOf(element, 'name'), ...(own !== undefined && { [OWN]: own }) },
        geometry: isModel ? { type: 'Model' } : shape ? ownPoint(geometryOf(shape, coordinates), own) : null,
      });
    }
  }
  const read = readFeatures(features, settings, 'KML');
  const { unreadable, onGround } = coordinates;
  const counted = (n: number): string => plural(n, { one: '{n} place', other: '{n} places' });
  return {
    ...read,
    dropped: [
      ...read.dropped,
      ...(unreadable > 0
        ? [
            t('{counted} left out: not "longitude,latitude,height" with decimal points.', {
              counted: counted(unreadable),
            }),
          ]
        : []),
      ...(others.NetworkLink > 0 ? [t('What the file only links to is left out: save it from there.')] : []),
      ...(others.overlays > 0 ? [t('Image overlays on the map are left out.')] : []),
    ],
    assumed: [
      ...(read.assumed ?? []),
      ...(onGround > 0
        ? [
            t('The heights of {counted} are not taken: the file lays these shapes on the ground (clampToGround).', {
              counted: counted(onGround),
            }),
          ]
        : []),
    ],
  };
}

/** Our own parts are single points; the format allows several in one. */
function ownPoint(geometry: JsonObject, own: string | undefined): JsonObject {
  if (own === undefined || geometry['type'] !== 'MultiPoint') return geometry;
  return { ...geometry, type: 'Point', coordinates: (geometry['coordinates'] as readonly Position[])[0] };
}

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
