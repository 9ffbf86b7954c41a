/**
 * Heights of the ground in image tiles (terrarium), read bilinearly. Where there is no tile there is no height; a
 * coarser zoom does not stand in for a missing tile, as it would hide what rises between its points. Pure.
 */

import type { Place } from '../link/messages';

const OFFSET_M = 32_768;
/** Black: the tile has no height there. */
const UNKNOWN_M = -OFFSET_M;
const MAX_LAT_DEG = 85.05;

/** Metres above the sea, row by row. */
export interface HeightTile {
  readonly side: number;
  readonly heightsM: Float32Array;
}

/** Metres above the sea; null: nobody knows; undefined: not loaded yet. */
export type GroundHeight = number | null | undefined;

/** `undefined`: not loaded yet. */
export type TileAt = (x: number, y: number) => HeightTile | null | undefined;

/** From the pixels of a canvas: red, green, blue, alpha. */
export function decodeTerrarium(pixels: Uint8ClampedArray, side: number): HeightTile {
  const heightsM = new Float32Array(side * side);
  for (let at = 0; at < heightsM.length; at += 1) {
    const from = at * 4;
    heightsM[at] = pixels[from]! * 256 + pixels[from + 1]! + pixels[from + 2]! / 256 - OFFSET_M;
  }
  return { side, heightsM };
}

export function heightAt({ latDeg, lonDeg }: Place, zoom: number, tileAt: TileAt): GroundHeight {
  if (!(Math.abs(latDeg) <= MAX_LAT_DEG && Math.abs(lonDeg) <= 180)) return null;
  const tiles = 2 ** zoom;
  const across = ((lonDeg + 180) / 360) * tiles;
  const along = (0.5 - Math.log(Math.tan(Math.PI / 4 + (latDeg * Math.PI) / 360)) / (2 * Math.PI)) * tiles;
  const [ownX, ownY] = [Math.floor(across), Math.min(Math.max(Math.floor(along), 0), tiles - 1)];
  const own = tileAt(ownX % tiles, ownY);
  if (!own) return own;
  const { side } = own;
  // Heights stand at the middles of pixels.
  const [x, y] = [across * side - 0.5, along * side - 0.5];
  const [left, top] = [Math.floor(x), Math.floor(y)];
  const [shareX, shareY] = [x - left, y - top];
  const last = side - 1;
  let isLoading = false;
  const point = (column: number, row: number): number => {
    const [tileX, tileY] = [Math.floor(column / side), Math.floor(row / side)];
    const isOwn = tileX === ownX && tileY === ownY;
    const tile = isOwn ? own : tileY < 0 || tileY >= tiles ? null : tileAt((tileX + tiles) % tiles, tileY);
    if (tile === undefined) isLoading = true;
    if (tile?.side === side) return tile.heightsM[(row - tileY * side) * side + column - tileX * side]!;
    // At the edge of what is known its last row goes on, for half a pixel.
    const [edgeX, edgeY] = [column - ownX * side, row - ownY * side].map((at) => Math.min(Math.max(at, 0), last));
    return own.heightsM[edgeY! * side + edgeX!]!;
  };
  const corners = [point(left, top), point(left + 1, top), point(left, top + 1), point(left + 1, top + 1)] as const;
  if (isLoading) return undefined;
  if (corners.includes(UNKNOWN_M)) return null;
  const upper = corners[0] * (1 - shareX) + corners[1] * shareX;
  const lower = corners[2] * (1 - shareX) + corners[3] * shareX;
  return upper * (1 - shareY) + lower * shareY;
}
