/**
 * A MapLibre map with the embedded basemap (coastlines and borders, served by the tower), and tiles over it if
 * available.
 */

import {
  Map as MapLibreMap,
  NavigationControl,
  ScaleControl,
  setWorkerUrl,
  type StyleSpecification,
} from 'maplibre-gl';
import workerUrl from 'maplibre-gl/dist/maplibre-gl-worker.mjs?worker&url';
import 'maplibre-gl/dist/maplibre-gl.css';

import { t } from '../languages/text';
import { faultOf } from './map_errors';
import type { Shown } from './map_layers';
import { withRelief } from './relief';
import { readTheme, type MapTheme } from './theme';
import { tileLayers, tileSources } from './tile_layers';

export { readLayers } from './tile_source';
export { drawAircraft } from './aircraft_overlay';
export { drawZones } from './zones_overlay';

setWorkerUrl(new URL(workerUrl, import.meta.url).href);

const MAX_ZOOM = 21;

function basemap(theme: MapTheme, shown: Shown): StyleSpecification {
  const served = (name: string): string => new URL(`basemap/${name}.json`, document.baseURI).href;
  // Natural Earth is coarse: beyond this zoom its tiles are only stretched.
  const source = (name: string) => ({ type: 'geojson' as const, data: served(name), maxzoom: 8, tolerance: 0.3 });
  return {
    version: 8,
    sources: { land: source('land'), borders: source('borders'), ...tileSources(shown) },
    layers: [
      { id: 'sea', type: 'background', paint: { 'background-color': theme.sea } },
      {
        id: 'land',
        type: 'fill',
        source: 'land',
        // The coastline is drawn over its edge.
        paint: { 'fill-color': theme.land, 'fill-antialias': false },
      },
      { id: 'borders', type: 'line', source: 'borders', paint: { 'line-color': theme.border, 'line-width': 1 } },
      { id: 'coast', type: 'line', source: 'land', paint: { 'line-color': theme.coast, 'line-width': 1 } },
      ...tileLayers(shown, theme),
    ],
  };
}

export function createMap(container: HTMLElement, shown: Shown): MapLibreMap {
  const map = new MapLibreMap({
    container,
    style: basemap(readTheme(), shown),
    center: [8, 47],
    zoom: 3,
    maxZoom: MAX_ZOOM,
    attributionControl: false,
    dragRotate: false,
    pitchWithRotate: false,
    touchPitch: false,
    fadeDuration: 0,
    renderWorldCopies: true,
    locale: { 'Map.Title': t('Map. Arrow keys move it, plus and minus zoom.') },
  });
  map.touchZoomRotate.disableRotation();
  map.keyboard.disableRotation();
  map.addControl(new NavigationControl({ showCompass: false }), 'top-right');
  map.addControl(new ScaleControl({ maxWidth: 120, unit: 'metric' }), 'bottom-right');
  map.on('error', ({ error }) => {
    const fault = faultOf(error);
    if (fault) reportError(fault);
  });
  return map;
}

/** Draws with other layers or another theme; the view stays. */
export function restyle(map: MapLibreMap, shown: Shown): void {
  map.setStyle(basemap(readTheme(), shown), { diff: true, transformStyle: withRelief });
}
