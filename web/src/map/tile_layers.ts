/**
 * Extends the map's style for tiles: their source, and layers over the coastline. Raster tiles are drawn as they are.
 * Vector tiles get a plain style of our own in the theme's colours, without labels (these would need external fonts).
 */

import type { LayerSpecification, SourceSpecification } from 'maplibre-gl';

import type { MapTheme } from './theme';

/** The tower's answer to `GET /map`, and for vector tiles the names of their layers. */
export interface Tiles {
  readonly from: 'addresses' | 'file';
  readonly kind: 'raster' | 'vector';
  readonly url: string;
  readonly mostZoom: number | null;
  readonly attribution: string;
  readonly layers: readonly string[];
}

export const TILES = 'tiles';

type TileTheme = Pick<MapTheme, 'sea' | 'land' | 'border' | 'green' | 'building' | 'road'>;

type Drawing = 'fill' | 'line';
interface Row {
  readonly names: readonly string[];
  readonly as: Drawing;
  readonly colour: keyof TileTheme;
  readonly widths?: readonly [zoom: number, px: number][];
}

/** From bottom to top, by the layer names of the Protomaps and the OpenMapTiles schema; others are not drawn. */
const ROWS: readonly Row[] = [
  { names: ['earth'], as: 'fill', colour: 'land' },
  { names: ['landcover', 'park'], as: 'fill', colour: 'green' },
  { names: ['water'], as: 'fill', colour: 'sea' },
  {
    names: ['waterway'],
    as: 'line',
    colour: 'sea',
    widths: [
      [8, 0.5],
      [18, 5],
    ],
  },
  { names: ['buildings', 'building'], as: 'fill', colour: 'building' },
  {
    names: ['roads', 'transportation', 'aeroway'],
    as: 'line',
    colour: 'road',
    widths: [
      [6, 0.4],
      [12, 1],
      [18, 7],
    ],
  },
  {
    names: ['boundaries', 'boundary'],
    as: 'line',
    colour: 'border',
    widths: [
      [4, 0.6],
      [12, 1.5],
    ],
  },
];

export function tileSource(tiles: Tiles): SourceSpecification {
  const scheme = tiles.from === 'file' ? { url: `pmtiles://${tiles.url}` } : { tiles: [tiles.url] };
  if (tiles.kind === 'vector') return { type: 'vector', ...scheme };
  const zoom = tiles.mostZoom === null ? {} : { maxzoom: tiles.mostZoom };
  return { type: 'raster', tileSize: 256, ...scheme, ...zoom };
}

export function tileLayers(tiles: Tiles, theme: TileTheme): LayerSpecification[] {
  if (tiles.kind === 'raster')
    return [{ id: TILES, type: 'raster', source: TILES, paint: { 'raster-fade-duration': 0 } }];
  return ROWS.flatMap((row) =>
    row.names.filter((name) => tiles.layers.includes(name)).map((name) => layer(row, name, theme)),
  );
}

function layer({ as, colour, widths }: Row, name: string, theme: TileTheme): LayerSpecification {
  const common = { id: `${TILES}-${name}`, source: TILES, 'source-layer': name };
  if (as === 'fill') {
    return {
      ...common,
      type: 'fill',
      filter: ['==', ['geometry-type'], 'Polygon'],
      paint: { 'fill-color': theme[colour] },
    };
  }
  const stops = (widths ?? [[0, 1]]).flat();
  return {
    ...common,
    type: 'line',
    filter: ['!=', ['geometry-type'], 'Point'],
    layout: { 'line-cap': 'round', 'line-join': 'round' },
    paint: {
      'line-color': theme[colour],
      'line-width': ['interpolate', ['exponential', 1.5], ['zoom'], ...stops] as never,
    },
  };
}
