/**
 * Extends the map's style for the tower's layers, over the coastline: the ground of a vector map, imagery over it,
 * the shaded shape of the ground, then roads and names. Names stay legible over imagery, and where imagery is missing or pale the map shows through.
 */

import type { LayerSpecification, SourceSpecification } from 'maplibre-gl';

import type { MapLayer, Shown } from './map_layers';
import { areaLayers, labelLayers, lineLayers, type VectorTheme } from './vector_style';

export type TileTheme = VectorTheme & {
  readonly imagery: { readonly brightness: number; readonly saturation: number };
};

export const sourceId = ({ id }: MapLayer): string => `tiles-${id}`;

export function tileSource(layer: MapLayer): SourceSpecification {
  const where = layer.source === 'file' ? { url: `pmtiles://${layer.url}` } : { tiles: [layer.url] };
  if (layer.role === 'terrain') {
    const zoom = layer.maxZoom === null ? {} : { maxzoom: layer.maxZoom };
    return { type: 'raster-dem', encoding: 'terrarium', tileSize: layer.tileSize, ...where, ...zoom };
  }
  if (layer.kind === 'vector') return { type: 'vector', ...where };
  const zoom = layer.maxZoom === null ? {} : { maxzoom: layer.maxZoom };
  return { type: 'raster', tileSize: layer.tileSize, ...where, ...zoom };
}

export function tileSources({ imagery, map, relief }: Shown): Record<string, SourceSpecification> {
  const layers = [map, imagery, relief].filter((layer) => layer !== null);
  return Object.fromEntries(layers.map((layer) => [sourceId(layer), tileSource(layer)]));
}

export function tileLayers({ imagery, map, opacity, labels, relief }: Shown, theme: TileTheme): LayerSpecification[] {
  const under = imagery ? 'imagery' : 'ground';
  const vector = map?.kind === 'vector' ? ({ source: sourceId(map), parts: map.parts, theme, under } as const) : null;
  return [
    ...(map?.kind === 'raster' ? [raster(map, { 'raster-fade-duration': 0 })] : []),
    ...(vector ? areaLayers(vector) : []),
    ...(imagery
      ? [
          raster(imagery, {
            'raster-fade-duration': 0,
            'raster-opacity': opacity,
            'raster-brightness-max': theme.imagery.brightness,
            'raster-saturation': theme.imagery.saturation,
          }),
        ]
      : []),
    ...(relief ? [shaded(relief)] : []),
    ...(vector ? lineLayers(vector) : []),
    ...(vector && labels ? labelLayers(vector) : []),
  ];
}

/** Faint: the map under it counts more. */
const shaded = (layer: MapLayer): LayerSpecification => ({
  id: sourceId(layer),
  type: 'hillshade',
  source: sourceId(layer),
  paint: { 'hillshade-exaggeration': 0.35 },
});

const raster = (layer: MapLayer, paint: object): LayerSpecification => ({
  id: sourceId(layer),
  type: 'raster',
  source: sourceId(layer),
  paint,
});
