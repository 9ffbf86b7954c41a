import { describe, expect, it } from 'vitest';

import { TILES, tileLayers, tileSource, type Tiles } from '../../src/map/tile_layers';

const THEME = { sea: 'blue', land: 'beige', border: 'grey', green: 'green', building: 'brown', road: 'white' };
const FILE: Tiles = {
  from: 'file',
  kind: 'vector',
  url: 'https://tower.example.org/api/v1/map/tiles.pmtiles?v=1',
  mostZoom: null,
  attribution: '',
  layers: [],
};

describe('the source of tiles', () => {
  it('of a file is found by the protocol of its format, which knows its zooms', () => {
    expect(tileSource(FILE)).toEqual({ type: 'vector', url: `pmtiles://${FILE.url}` });
    expect(tileSource({ ...FILE, kind: 'raster' })).toEqual({
      type: 'raster',
      tileSize: 256,
      url: `pmtiles://${FILE.url}`,
    });
  });

  it('elsewhere is the template, up to the zoom that is set', () => {
    const template = 'https://tiles.example.org/{z}/{x}/{y}.png';
    const tiles: Tiles = { ...FILE, from: 'addresses', kind: 'raster', url: template, mostZoom: 17 };
    expect(tileSource(tiles)).toEqual({ type: 'raster', tileSize: 256, tiles: [template], maxzoom: 17 });
  });
});

describe('the layers of tiles', () => {
  it('are one for images', () => {
    expect(tileLayers({ ...FILE, kind: 'raster' }, THEME).map(({ id, type }) => [id, type])).toEqual([
      [TILES, 'raster'],
    ]);
  });

  it.each([
    ['Protomaps', ['roads', 'places', 'water', 'earth', 'buildings'], ['earth', 'water', 'buildings', 'roads']],
    [
      'OpenMapTiles',
      ['transportation', 'transportation_name', 'water', 'waterway', 'boundary', 'landcover'],
      ['landcover', 'water', 'waterway', 'transportation', 'boundary'],
    ],
    ['any other', ['my-own'], []],
  ])('of %s vector tiles are those that it has and we know, in our order', (_schema, layers, drawn) => {
    const ids = tileLayers({ ...FILE, layers }, THEME).map(({ id }) => id);
    expect(ids).toEqual(drawn.map((name) => `${TILES}-${name}`));
  });

  it('have the colours of the theme and no words', () => {
    const made = tileLayers({ ...FILE, layers: ['water', 'roads'] }, THEME);
    expect(made.map(({ type }) => type)).toEqual(['fill', 'line']);
    expect(made[0]).toMatchObject({ 'source-layer': 'water', paint: { 'fill-color': 'blue' } });
    expect(made[1]).toMatchObject({ 'source-layer': 'roads', paint: { 'line-color': 'white' } });
    expect(JSON.stringify(made)).not.toContain('text-');
  });
});
