/**
 * Converts places to pixels of a map that looks straight down with north up. MapLibre's own projection does the same
 * for any camera, with matrices, at ten times the cost: too much for the trails of 200 drones.
 */

import type { Place } from '../link/messages';

const TILE_PX = 512;
const RADIANS = Math.PI / 180;

export interface Point {
  readonly x: number;
  readonly y: number;
}

export interface Camera {
  readonly centre: Place;
  readonly zoom: number;
  readonly widthPx: number;
  readonly heightPx: number;
}

/** Web Mercator, 0..1 from west to east and from north to south. */
const mercatorX = (lonDeg: number): number => (lonDeg + 180) / 360;
const mercatorY = (latDeg: number): number =>
  0.5 - Math.log(Math.tan(Math.PI / 4 + (latDeg * RADIANS) / 2)) / (2 * Math.PI);

export class Projection {
  readonly #worldPx: number;
  readonly #x: number;
  readonly #y: number;
  readonly #halfWidth: number;
  readonly #halfHeight: number;

  constructor({ centre, zoom, widthPx, heightPx }: Camera) {
    this.#worldPx = TILE_PX * 2 ** zoom;
    this.#x = mercatorX(centre.lonDeg);
    this.#y = mercatorY(centre.latDeg);
    this.#halfWidth = widthPx / 2;
    this.#halfHeight = heightPx / 2;
  }

  /** Uses the copy of the world nearest to the middle of the map. */
  at({ latDeg, lonDeg }: Place): Point {
    const east = mercatorX(lonDeg) - this.#x;
    return {
      x: this.#halfWidth + (east - Math.round(east)) * this.#worldPx,
      y: this.#halfHeight + (mercatorY(latDeg) - this.#y) * this.#worldPx,
    };
  }
}
