/**
 * The shape of the ground on a tilted map. MapLibre draws the tower's elevation, and what we draw ourselves follows
 * through `drawnGround`. Heights are true to scale.
 */

import type { Map as MapLibreMap, StyleSpecification } from 'maplibre-gl';

import type { Place } from '../link/messages';
import type { GroundHeight } from '../terrain/height_tiles';
import type { MapLayer } from './map_layers';
import type { DrawnGround } from './projection';
import { tileSource } from './tile_layers';

/** Apart from that of the shaded relief: MapLibre draws both better so. */
const SOURCE = 'ground-shape';
const AT_SEA_M = 1;

/** Above the sea. */
export interface Relief {
  readonly homeM: number;
  readonly heightM: (place: Place) => GroundHeight;
}

const shown = new WeakMap<MapLibreMap, Relief>();

/** Draws the ground with its shape until the returned function is called. Centre and zoom stay. */
export function showRelief(map: MapLibreMap, layer: MapLayer, relief: Relief): () => void {
  let isWanted = true;
  let isRemoved = false;
  const show = (): void => {
    if (!isWanted) return;
    if (!map.getSource(SOURCE)) map.addSource(SOURCE, tileSource(layer));
    shown.set(map, relief);
    keepingView(map, () => map.setTerrain({ source: SOURCE, exaggeration: 1 }));
  };
  const removed = (): void => {
    isRemoved = true;
  };
  map.on('remove', removed);
  // Before its style is loaded a map has no layers, and takes no sources.
  if (map.getLayer('sea')) show();
  else map.once('style.load', show);
  return () => {
    isWanted = false;
    shown.delete(map);
    map.off('remove', removed);
    if (isRemoved || !map.getSource(SOURCE)) return;
    keepingView(map, () => map.setTerrain(null));
    map.removeSource(SOURCE);
  };
}

function keepingView(map: MapLibreMap, change: () => void): void {
  const [center, zoom] = [map.getCenter(), map.getZoom()];
  change();
  map.jumpTo({ center, zoom });
}

/** For a change of style: the ground keeps its shape. */
export function withRelief(before: StyleSpecification | undefined, next: StyleSpecification): StyleSpecification {
  const source = before?.sources[SOURCE];
  if (!before?.terrain || !source) return next;
  return { ...next, sources: { ...next.sources, [SOURCE]: source }, terrain: before.terrain };
}

/** Null: the map is flat. Where no height is known the ground counts as high as home. */
export function drawnGround(map: MapLibreMap): DrawnGround | null {
  const relief = shown.get(map);
  if (!relief) return null;
  const { homeM, heightM } = relief;
  const [{ lat, lng }, centreM] = [map.getCenter(), map.getCenterElevation()];
  // MapLibre draws the ground at 0 until it has its tile.
  if (centreM === 0 && Math.abs(heightM({ latDeg: lat, lonDeg: lng }) ?? 0) > AT_SEA_M) return null;
  return { homeM, centreM, heightM: (place) => heightM(place) ?? homeM };
}
