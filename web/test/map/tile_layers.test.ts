import { describe, expect, it } from 'vitest';

import type { MapLayer, Shown } from '../../src/map/map_layers';
import { tileLayers, tileSource, tileSources, type TileTheme } from '../../src/map/tile_layers';

/** A colour for each name. */
const named = (): Record<string, string> => new Proxy({}, { get: (_, name) => `the ${String(name)}` });
const THEME = {
  sea: 'blue',
  land: 'beige',
  border: 'grey',
  ground: named(),
  label: named(),
  imagery: { brightness: 0.8, saturation: -0.2 },
} as unknown as TileTheme;
const MAP: MapLayer = {
  id: 'region',
  name: 'Region',
  role: 'map',
  kind: 'vector',
  source: 'file',
  url: 'https://tower.example.org/api/v1/map/files/region?v=1',
  tileSize: 256,
  maxZoom: null,
  attribution: '',
  parts: ['places', 'roads', 'water', 'earth', 'buildings'],
};
const IMAGERY: MapLayer = { ...MAP, id: 'above', role: 'imagery', kind: 'raster', tileSize: 512, parts: [] };
const HILLS: MapLayer = { ...MAP, id: 'hills', role: 'terrain', kind: 'raster', parts: [] };
const shown = (changes: Partial<Shown>): Shown => ({
  imagery: null,
  map: null,
  opacity: 1,
  labels: true,
  relief: null,
  ...changes,
});
const drawn = (changes: Partial<Shown>): string[] => tileLayers(shown(changes), THEME).map(({ id }) => id);

describe('the source of tiles', () => {
  it('of a file is found by the protocol of its format, which knows its zooms', () => {
    expect(tileSource(MAP)).toEqual({ type: 'vector', url: `pmtiles://${MAP.url}` });
    expect(tileSource(IMAGERY)).toEqual({ type: 'raster', tileSize: 512, url: `pmtiles://${IMAGERY.url}` });
  });

  it('of heights is one of elevation, and its shape is shaded under the names', () => {
    const { url, tileSize } = HILLS;
    const source = { type: 'raster-dem', encoding: 'terrarium', tileSize, url: `pmtiles://${url}` };
    expect(tileSource(HILLS)).toEqual(source);
    const ids = drawn({ map: MAP, imagery: IMAGERY, relief: HILLS });
    expect(ids.indexOf('tiles-hills')).toBe(ids.indexOf('tiles-above') + 1);
    expect(ids.findIndex((id) => id.includes('label'))).toBeGreaterThan(ids.indexOf('tiles-hills'));
  });

  it('of single tiles is the template, up to the zoom that is set', () => {
    const template = '/api/v1/map/sources/1/{z}/{x}/{y}';
    const tiles: MapLayer = { ...MAP, source: 'addresses', kind: 'raster', url: template, maxZoom: 17 };
    expect(tileSource(tiles)).toEqual({ type: 'raster', tileSize: 256, tiles: [template], maxzoom: 17 });
  });

  it('is there for what is drawn only', () => {
    expect(Object.keys(tileSources(shown({})))).toEqual([]);
    expect(Object.keys(tileSources(shown({ map: MAP, imagery: IMAGERY })))).toEqual(['tiles-region', 'tiles-above']);
  });
});

describe('the layers of tiles', () => {
  it('are one for images, with the opacity that the user chose', () => {
    const [image, ...others] = tileLayers(shown({ imagery: IMAGERY, opacity: 0.4 }), THEME);
    expect(image).toMatchObject({ id: 'tiles-above', type: 'raster', paint: { 'raster-opacity': 0.4 } });
    expect(others).toEqual([]);
  });

  it.each([
    [
      'Protomaps',
      ['roads', 'places', 'water', 'earth', 'buildings'],
      [
        'earth',
        'water',
        'buildings',
        'roads-path',
        'roads-edge',
        'roads',
        'roads-label',
        'water-label',
        'places-label',
      ],
    ],
    [
      'OpenMapTiles',
      ['transportation', 'transportation_name', 'water', 'waterway', 'boundary', 'landcover', 'place'],
      [
        ...[
          'landcover',
          'water',
          'waterway',
          'transportation-path',
          'transportation-edge',
          'transportation',
          'boundary',
        ],
        ...['transportation_name-label', 'water-label', 'place-label'],
      ],
    ],
    ['any other', ['my-own'], []],
  ])('of %s vector tiles are those that it has and we know, in our order', (_schema, parts, names) => {
    expect(drawn({ map: { ...MAP, parts } })).toEqual(names.map((name) => `tiles-region-${name}`));
  });

  it('put imagery over the ground of a map, and roads and names over the imagery', () => {
    const ids = drawn({ map: MAP, imagery: IMAGERY });
    const at = (name: string): number => ids.indexOf(name);
    expect(at('tiles-region-buildings')).toBeLessThan(at('tiles-above'));
    expect(at('tiles-above')).toBeLessThan(at('tiles-region-roads'));
    expect(at('tiles-region-roads')).toBeLessThan(at('tiles-region-places-label'));
  });

  it('have the colours of the theme, and others for words over imagery', () => {
    const colourOf = (changes: Partial<Shown>): unknown =>
      tileLayers(shown({ map: MAP, ...changes }), THEME).find(({ id }) => id.endsWith('places-label'))?.paint;
    expect(colourOf({})).toMatchObject({ 'text-color': 'the place', 'text-halo-color': 'the halo' });
    expect(colourOf({ imagery: IMAGERY })).toMatchObject({ 'text-color': 'the onImagery' });
    expect(tileLayers(shown({ map: MAP }), THEME).find(({ id }) => id.endsWith('water'))).toMatchObject({
      'source-layer': 'water',
      paint: { 'fill-color': 'blue' },
    });
  });

  it('have no words if the user wants none, and ask nobody for letters', () => {
    expect(drawn({ map: MAP, labels: false }).filter((id) => id.includes('label'))).toEqual([]);
    const fonts = tileLayers(shown({ map: MAP }), THEME).flatMap((layer) =>
      layer.type === 'symbol' ? (layer.layout?.['text-font'] as string[]) : [],
    );
    expect(new Set(fonts)).toEqual(new Set(['Inter Variable', 'Map Semibold']));
  });
});
