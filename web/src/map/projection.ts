/**
 * Converts places to pixels of a map with north up that looks straight down, or is tilted. MapLibre's own projection
 * does the same for any camera, with matrices, at ten times the cost: too much for the trails of 200 drones.
 */

import type { Place } from '../link/messages';

const TILE_PX = 512;
const RADIANS = Math.PI / 180;
const EARTH_ROUND_M = 40_075_016.7;
/** MapLibre's own. */
const FIELD_OF_VIEW_DEG = 36.869_897_645_844_02;
/** Of the distance from the eye to the middle of the map. Nearer or behind the eye has no place on the screen. */
const LEAST_DEPTH = 0.05;

export interface Point {
  readonly x: number;
  readonly y: number;
}

/** The shape of the ground that the map draws. Metres above the sea. */
export interface DrawnGround {
  readonly homeM: number;
  /** What the map turns about. */
  readonly centreM: number;
  readonly heightM: (place: Place) => number;
}

export interface Camera {
  readonly centre: Place;
  readonly zoom: number;
  readonly widthPx: number;
  readonly heightPx: number;
  /** 0 (default): straight down; below 90. */
  readonly tiltDeg?: number;
  /** Null (default): flat. A map that looks straight down is always flat. */
  readonly ground?: DrawnGround | null;
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
  readonly #sin: number;
  readonly #cos: number;
  readonly #eyePx: number;
  readonly #ground: DrawnGround | null;

  constructor({ centre, zoom, widthPx, heightPx, tiltDeg = 0, ground = null }: Camera) {
    this.#worldPx = TILE_PX * 2 ** zoom;
    this.#x = mercatorX(centre.lonDeg);
    this.#y = mercatorY(centre.latDeg);
    this.#halfWidth = widthPx / 2;
    this.#halfHeight = heightPx / 2;
    this.#sin = Math.sin(tiltDeg * RADIANS);
    this.#cos = Math.cos(tiltDeg * RADIANS);
    this.#ground = tiltDeg > 0 ? ground : null;
    this.#eyePx = heightPx / 2 / Math.tan((FIELD_OF_VIEW_DEG / 2) * RADIANS);
  }

  get isTilted(): boolean {
    return this.#sin > 0;
  }

  /**
   * Uses the copy of the world nearest to the middle of the map. `upM`: height above home, which a tilted map shows;
   * 0: on the ground. A map that looks straight down leaves it out: a drone stays over its place, however high it is.
   */
  at(place: Place, upM = 0): Point {
    if (upM !== 0) return this.aboveHome(place, upM);
    const ground = this.#ground;
    return this.#raised(place, ground ? ground.heightM(place) - ground.centreM : 0);
  }

  /** As `at`, also for the height of home itself, which over a valley is not the ground. */
  aboveHome(place: Place, heightM: number): Point {
    const ground = this.#ground;
    return this.#raised(place, ground ? ground.homeM + heightM - ground.centreM : heightM);
  }

  /** `upM`: above the middle of the map. */
  #raised({ latDeg, lonDeg }: Place, upM: number): Point {
    const across = mercatorX(lonDeg) - this.#x;
    const east = (across - Math.round(across)) * this.#worldPx;
    const south = (mercatorY(latDeg) - this.#y) * this.#worldPx;
    if (this.#sin === 0) return { x: this.#halfWidth + east, y: this.#halfHeight + south };
    const up = upM === 0 ? 0 : (upM * this.#worldPx) / (EARTH_ROUND_M * Math.cos(latDeg * RADIANS));
    const depth = this.#eyePx - south * this.#sin - up * this.#cos;
    const scale = this.#eyePx / Math.max(depth, LEAST_DEPTH * this.#eyePx);
    return {
      x: this.#halfWidth + east * scale,
      y: this.#halfHeight + (south * this.#cos - up * this.#sin) * scale,
    };
  }
}
