/** GPX: waypoints, routes and each segment of tracks. Its heights (`ele`) are above sea level. */

import { FRAME } from '../frames';
import { HEIGHTS_FROM } from './found_shapes';
import { readFeatures } from './geojson_plan';
import type { JsonObject } from './json_values';
import type { ReadFile, ReadSettings } from './plan_file';
import { childrenOf, descendantsOf, textOf } from './xml';

/** A missing or damaged number makes it no place on earth, which is counted. */
function positionOf(point: Element): number[] {
  const [lat, lon] = ['lat', 'lon'].map((name) => Number(point.getAttribute(name) || NaN));
  const height = textOf(point, 'ele').trim();
  return [lon!, lat!, ...(height === '' ? [] : [Number(height)])];
}

function featureOf(name: string, type: 'LineString' | 'MultiPoint', points: readonly Element[]): JsonObject {
  const geometry = { type, coordinates: points.map(positionOf), [HEIGHTS_FROM]: FRAME.GLOBAL };
  return { properties: { name }, geometry };
}

const childrenNamed = (element: Element, name: string): Element[] =>
  childrenOf(element).filter(({ localName }) => localName === name);

export function readGpx(root: Element, settings: ReadSettings): ReadFile {
  const features = descendantsOf(root).flatMap((element): JsonObject[] => {
    const name = textOf(element, 'name');
    switch (element.localName) {
      case 'wpt':
        return [featureOf(name, 'MultiPoint', [element])];
      case 'rte':
        return [featureOf(name, 'LineString', childrenNamed(element, 'rtept'))];
      case 'trk':
        return childrenNamed(element, 'trkseg').map((segment) =>
          featureOf(name, 'LineString', childrenNamed(segment, 'trkpt')),
        );
      default:
        return [];
    }
  });
  return readFeatures(features, settings, 'GPX');
}
