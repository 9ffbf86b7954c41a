import { describe, expect, it } from 'vitest';

import { decodeTerrarium, heightAt, type HeightTile } from '../../src/terrain/height_tiles';

const SIDE = 256;
const ZOOM = 4;

/** A plane in pixels of the whole world: bilinear reading must be exact on it, across the edges of tiles too. */
const plane = (x: number, y: number): number => 100 + 2 * x - 3 * y;

function tileOf(tileX: number, tileY: number): HeightTile {
  const pixels = new Uint8ClampedArray(SIDE * SIDE * 4);
  for (let row = 0; row < SIDE; row += 1) {
    for (let column = 0; column < SIDE; column += 1) {
      const value = plane(tileX * SIDE + column, tileY * SIDE + row) + 32_768;
      const at = (row * SIDE + column) * 4;
      pixels.set([Math.floor(value / 256), Math.floor(value) % 256, Math.round((value % 1) * 256), 255], at);
    }
  }
  return decodeTerrarium(pixels, SIDE);
}

const lonOf = (x: number): number => (x / (SIDE * 2 ** ZOOM)) * 360 - 180;
const latOf = (y: number): number =>
  (Math.atan(Math.sinh(Math.PI * (1 - (2 * y) / (SIDE * 2 ** ZOOM)))) * 180) / Math.PI;
const placeOf = (x: number, y: number) => ({ latDeg: latOf(y), lonDeg: lonOf(x) });

describe('heights in terrarium tiles', () => {
  const there = new Map([
    ['8/5', tileOf(8, 5)],
    ['9/5', tileOf(9, 5)],
    ['8/6', tileOf(8, 6)],
    ['9/6', tileOf(9, 6)],
  ]);
  const tileAt = (x: number, y: number) => there.get(`${x}/${y}`) ?? null;

  it('are unknown next to a pixel without a height', () => {
    const tile = tileOf(8, 5);
    tile.heightsM.set(decodeTerrarium(new Uint8ClampedArray(4), 1).heightsM, 20 * SIDE + 50); // black
    const withHole = (x: number, y: number) => (x === 8 && y === 5 ? tile : tileAt(x, y));
    const [x, y] = [8 * SIDE + 50.5, 5 * SIDE + 20.5];
    for (const [east, south] of [
      [0, 0],
      [0.9, 0],
      [-0.5, 0.9],
    ] as const) {
      expect(heightAt(placeOf(x + east, y + south), ZOOM, withHole)).toBeNull();
    }
    expect(heightAt(placeOf(x + 1.1, y), ZOOM, withHole)).toBeCloseTo(plane(x + 0.6, y - 0.5), 1);
  });

  it('are read between the middles of pixels, within a tile and across its edges', () => {
    for (const [x, y] of [
      [2100.5, 1300.5],
      [2101.25, 1300.9],
      [2303.9, 1400.1],
      [2304.2, 1535.9],
      [2304.4, 1536.3],
    ] as const) {
      expect(heightAt(placeOf(x, y), ZOOM, tileAt)).toBeCloseTo(plane(x - 0.5, y - 0.5), 1);
    }
  });

  it('are null where there is no tile, and end at the last row of what is known', () => {
    expect(heightAt(placeOf(100, 1400), ZOOM, tileAt)).toBeNull();
    expect(heightAt({ latDeg: 89, lonDeg: 8 }, ZOOM, tileAt)).toBeNull();
    expect(heightAt({ latDeg: 47, lonDeg: Number.NaN }, ZOOM, tileAt)).toBeNull();
    expect(heightAt(placeOf(2048.1, 1400.5), ZOOM, tileAt)).toBeCloseTo(plane(2048, 1400), 1);
  });

  it('are undefined while a tile that counts is being loaded', () => {
    const loading = (x: number, y: number) => (x === 9 ? undefined : tileAt(x, y));
    expect(heightAt(placeOf(2200, 1400), ZOOM, loading)).toBeTypeOf('number');
    expect(heightAt(placeOf(2303.9, 1400), ZOOM, loading)).toBeUndefined();
    expect(heightAt(placeOf(2400, 1400), ZOOM, loading)).toBeUndefined();
  });
});
