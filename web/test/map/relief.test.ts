import type { Map as MapLibreMap, StyleSpecification } from 'maplibre-gl';
import { describe, expect, it } from 'vitest';

import type { MapLayer } from '../../src/map/map_layers';
import { drawnGround, showRelief, withRelief } from '../../src/map/relief';

const HILLS: MapLayer = {
  id: 'hills',
  name: 'Hills',
  role: 'terrain',
  kind: 'raster',
  source: 'file',
  url: 'https://tower/maps/hills.pmtiles',
  tileSize: 256,
  maxZoom: 14,
  attribution: '',
  parts: [],
};
const HOME = { latDeg: 47.4, lonDeg: 8.5 };

/** What of MapLibre's map is used; turning its terrain on or off moves its view. */
function mapOf({ isLoaded = true } = {}) {
  const state = { sources: new Map<string, unknown>(), terrain: null as unknown, zoom: 16, centreM: 512, lon: 8.5 };
  const listeners = new Map<string, () => void>();
  const on = (event: string, listener: () => void) => listeners.set(event, listener);
  const map = {
    on,
    once: on,
    off: (event: string) => listeners.delete(event),
    getLayer: () => (isLoaded ? {} : undefined),
    getSource: (id: string) => state.sources.get(id),
    addSource: (id: string, source: unknown) => state.sources.set(id, source),
    removeSource: (id: string) => state.sources.delete(id),
    setTerrain: (terrain: unknown) => {
      state.terrain = terrain;
      state.zoom -= 0.4;
    },
    getCenter: () => ({ lat: 47.4, lng: state.lon }),
    getZoom: () => state.zoom,
    jumpTo: ({ zoom }: { zoom: number }) => (state.zoom = zoom),
    getCenterElevation: () => state.centreM,
  };
  return { map: map as unknown as MapLibreMap, state, fire: (event: string) => listeners.get(event)?.() };
}
const relief = { homeM: 490, heightM: ({ lonDeg }: { lonDeg: number }) => (lonDeg > 8.6 ? null : 505) };

describe('the shape of the ground', () => {
  it('is drawn true to scale from the elevation of the tower, and the view stays', () => {
    const { map, state } = mapOf();
    expect(drawnGround(map)).toBeNull();
    const hide = showRelief(map, HILLS, relief);
    expect(state.terrain).toEqual({ source: 'ground-shape', exaggeration: 1 });
    expect(state.sources.get('ground-shape')).toMatchObject({ type: 'raster-dem', encoding: 'terrarium' });
    expect(state.zoom).toBe(16);
    const ground = drawnGround(map)!;
    expect(ground.centreM).toBe(512);
    expect(ground.heightM(HOME)).toBe(505);
    expect(ground.heightM({ ...HOME, lonDeg: 8.7 }), 'unknown: as high as home').toBe(490);
    hide();
    expect([state.terrain, state.sources.size, state.zoom, drawnGround(map)]).toEqual([null, 0, 16, null]);
  });

  it('is flat until MapLibre has the tile in the middle, where there is one', () => {
    const { map, state } = mapOf();
    showRelief(map, HILLS, relief);
    state.centreM = 0;
    expect(drawnGround(map)).toBeNull();
    state.lon = 8.7;
    expect(drawnGround(map)?.centreM).toBe(0);
  });

  it('waits for the style, unless it is not wanted any more', () => {
    const one = mapOf({ isLoaded: false });
    showRelief(one.map, HILLS, relief);
    expect([one.state.terrain, drawnGround(one.map)]).toEqual([null, null]);
    one.fire('style.load');
    expect(one.state.terrain).not.toBeNull();
    const other = mapOf({ isLoaded: false });
    showRelief(other.map, HILLS, relief)();
    other.fire('style.load');
    expect(other.state.terrain).toBeNull();
  });

  it('asks nothing of a map that has been removed', () => {
    const { map, state, fire } = mapOf();
    const hide = showRelief(map, HILLS, relief);
    fire('remove');
    const before = state.terrain;
    hide();
    expect(state.terrain).toBe(before);
  });

  it('stays when layers or theme change', () => {
    const source = { type: 'raster-dem' as const, tiles: ['https://tower/{z}/{x}/{y}'] };
    const next: StyleSpecification = { version: 8, sources: {}, layers: [] };
    const before: StyleSpecification = {
      ...next,
      sources: { 'ground-shape': source },
      terrain: { source: 'ground-shape', exaggeration: 1 },
    };
    expect(withRelief(before, next)).toEqual(before);
    expect(withRelief(next, next)).toBe(next);
    expect(withRelief(undefined, next)).toBe(next);
  });
});
