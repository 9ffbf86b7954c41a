/**
 * What a file of shapes (GeoJSON, KML, GPX) shows: routes apart, outlines with their holes, marks. Collects them and
 * counts what cannot be taken; what they are for is for the user to say (import_choices.ts).
 */

import { plural, t } from '../../languages/text';
import type { Spot } from '../plan_types';
import { isNumber, isObject, placeOf, type JsonObject } from './json_values';
import { NotAPlanFile } from './plan_file';

export interface FoundPlace {
  readonly spot: Spot;
  /** Null: the file gives none. */
  readonly heightM: number | null;
}

export interface FoundRoute {
  readonly name: string;
  readonly places: readonly FoundPlace[];
  /** What the heights count from (MAV_FRAME); null if the file does not say. */
  readonly frame: number | null;
}

export interface FoundMark {
  readonly name: string;
  readonly place: FoundPlace;
  readonly frame: number | null;
}

export interface FoundArea {
  readonly name: string;
  readonly corners: readonly Spot[];
  readonly holes: readonly (readonly Spot[])[];
}

/** The frame of a geometry's heights, where its format says so. */
export const HEIGHTS_FROM = Symbol();
type Geometry = JsonObject & { readonly [HEIGHTS_FROM]?: number };

/** GeometryCollections nest; real files do not go deeper than this. */
const DEEPEST = 8;
const MAX_NAME = 60;

const isSame = (one: Spot, other: Spot): boolean => one.latE7 === other.latE7 && one.lonE7 === other.lonE7;
const listOf = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);

export class ShapeFinder {
  readonly routes: FoundRoute[] = [];
  readonly marks: FoundMark[] = [];
  readonly areas: FoundArea[] = [];
  readonly #left: string[] = [];
  #outside = 0;
  #repeated = 0;

  /** What was left out, one sentence each. */
  get left(): string[] {
    const outside = plural(this.#outside, { one: '{n} place', other: '{n} places' });
    return [
      ...this.#left,
      ...(this.#outside > 0
        ? [t('{counted} left out: not on earth, latitude and longitude in degrees.', { counted: outside })]
        : []),
    ];
  }

  get assumed(): string[] {
    if (this.#repeated === 0) return [];
    const counted = plural(this.#repeated, { one: '{n} place', other: '{n} places' });
    return [t('Places that repeat the one before are taken once: {counted}.', { counted })];
  }

  leave(words: string): void {
    this.#left.push(words);
  }

  /** Throws NotAPlanFile for what is no shape at all. */
  take(geometry: unknown, name: string, depth = 0): void {
    if (geometry === null || geometry === undefined) return;
    if (!isObject(geometry)) throw new NotAPlanFile(t('A feature in this file has no shape.'));
    const { type, coordinates } = geometry;
    const title = name.replace(/\s+/g, ' ').trim().slice(0, MAX_NAME);
    const frame = (geometry as Geometry)[HEIGHTS_FROM] ?? null;
    if (type === 'Point') this.#points([coordinates], title, frame);
    else if (type === 'MultiPoint') this.#points(coordinates, title, frame);
    else if (type === 'LineString') this.#route(coordinates, title, frame);
    else if (type === 'MultiLineString') for (const one of listOf(coordinates)) this.#route(one, title, frame);
    else if (type === 'Polygon') this.#area(coordinates, title);
    else if (type === 'MultiPolygon') for (const one of listOf(coordinates)) this.#area(one, title);
    else if (type === 'GeometryCollection' && depth < DEEPEST) {
      for (const one of listOf(geometry['geometries'])) this.take(one, name, depth + 1);
    } else this.leave(t('A shape of the kind "{type}" is left out.', { type: `${type}`.slice(0, 40) }));
  }

  #places(coordinates: unknown): FoundPlace[] {
    if (!Array.isArray(coordinates)) throw new NotAPlanFile(t('A shape in this file has no coordinates.'));
    return coordinates.flatMap((one: unknown): FoundPlace[] => {
      const spot = Array.isArray(one) ? placeOf(one[1], one[0]) : null;
      if (!spot) this.#outside += 1;
      const heightM: unknown = Array.isArray(one) ? one[2] : null;
      return spot ? [{ spot, heightM: isNumber(heightM) ? heightM : null }] : [];
    });
  }

  #points(coordinates: unknown, name: string, frame: number | null): void {
    for (const place of this.#places(coordinates)) this.marks.push({ name, place, frame });
  }

  #route(coordinates: unknown, name: string, frame: number | null): void {
    const all = this.#places(coordinates);
    const places = all.filter(({ spot, heightM }, at) => {
      const before = all[at - 1];
      return !before || !isSame(before.spot, spot) || before.heightM !== heightM;
    });
    this.#repeated += all.length - places.length;
    if (places.length < 2) return this.leave(t('A line with fewer than two places is left out.'));
    // Programs write 0 for a height that nobody has given.
    const isLevel = places.every(({ heightM }) => heightM === 0);
    this.routes.push({ name, frame, places: isLevel ? places.map(({ spot }) => ({ spot, heightM: null })) : places });
  }

  #area(rings: unknown, name: string): void {
    if (!Array.isArray(rings) || rings.length === 0) {
      throw new NotAPlanFile(t('An outline in this file has no corners.'));
    }
    const [corners, ...holes] = rings.map((ring: unknown): Spot[] => {
      const spots = this.#places(ring).map(({ spot }) => spot);
      const isClosed = spots.length > 1 && isSame(spots[0]!, spots.at(-1)!);
      return isClosed ? spots.slice(0, -1) : spots;
    });
    if (!corners || corners.length < 3) return this.leave(t('An outline with fewer than three corners is left out.'));
    this.areas.push({ name, corners, holes: holes.filter((hole) => hole.length >= 3) });
  }
}
