/**
 * Shapefiles (.shp with .prj): points, lines and outlines with their holes, converted to WGS 84. Each number of the file
 * is checked before it is followed. Loaded when such a file is opened.
 */

import proj4 from 'proj4';

import { t } from '../../languages/text';
import { FRAME } from '../frames';
import { HEIGHTS_FROM } from './found_shapes';
import type { JsonObject } from './json_values';
import { NotAPlanFile } from './plan_file';

export interface ShapeLayer {
  readonly name: string;
  readonly shp: Uint8Array;
  /** The text of its .prj; null: it has none. */
  readonly prj: string | null;
}

export interface ReadLayer {
  readonly features: readonly JsonObject[];
  readonly assumed: readonly string[];
}

type Position = number[];
type Ring = Position[];

const MAGIC = 9994;
const HEADER = 100;
/** Points and parts of one file: what takes time is counted, not only bytes. */
const MAX_POINTS = 200_000;
const MAX_RINGS = 500;
const NO_SHAPE = 0;
/** Of proj4: a datum whose shift to WGS 84 it does not know. */
const UNKNOWN_DATUM = 5;

export const looksLikeShapes = (bytes: Uint8Array): boolean =>
  bytes.length >= HEADER && new DataView(bytes.buffer, bytes.byteOffset).getInt32(0) === MAGIC;

const damaged = (): NotAPlanFile => new NotAPlanFile(t('This shapefile is damaged: its numbers lead out of the file.'));

/** Throws NotAPlanFile. */
export function readShapes({ name, shp, prj }: ShapeLayer): ReadLayer {
  if (!looksLikeShapes(shp)) throw new NotAPlanFile(t('"{name}" is no shapefile.', { name }));
  const { convert, assumed } = conversion(shp, prj);
  const features: JsonObject[] = [];
  const reader = new ShapeReader(convert);
  const view = new DataView(shp.buffer, shp.byteOffset, shp.byteLength);
  for (let at = HEADER; at + 8 <= shp.length;) {
    const length = view.getInt32(at + 4) * 2;
    if (length < 4 || at + 8 + length > shp.length) throw damaged();
    const geometry = reader.shape(new DataView(shp.buffer, shp.byteOffset + at + 8, length));
    if (geometry) features.push({ properties: { name }, geometry });
    at += 8 + length;
  }
  return { features, assumed };
}

/** To longitude and latitude, in degrees of WGS 84. */
function conversion(shp: Uint8Array, prj: string | null): { convert: (at: Position) => Position; assumed: string[] } {
  if (prj === null) {
    const view = new DataView(shp.buffer, shp.byteOffset);
    const [west, south, east, north] = [36, 44, 52, 60].map((at) => view.getFloat64(at, true)) as [
      number,
      number,
      number,
      number,
    ];
    const isDegrees = west >= -180 && east <= 180 && south >= -90 && north <= 90;
    if (isDegrees) return { convert: (at) => at, assumed: [t('It has no .prj: its numbers are taken as degrees.')] };
    throw new NotAPlanFile(
      t('These shapes are not in degrees, and no .prj says in what: open a .zip with the .shp and its .prj.'),
    );
  }
  try {
    const from = new proj4.Proj(prj);
    const { forward } = proj4(from, new proj4.Proj('WGS84'));
    const system = /"([^"]+)"/.exec(prj)?.[1] ?? '.prj';
    const isUnknown = from.datum?.datum_type === UNKNOWN_DATUM;
    return {
      convert: (at) => forward(at),
      assumed: [
        t('Converted to degrees of WGS 84 from "{system}".', { system: system.slice(0, 60) }),
        ...(isUnknown ? [t('How its datum lies to WGS 84 is not known: places can be off by 100 m and more.')] : []),
      ],
    };
  } catch {
    throw new NotAPlanFile(
      t('The coordinate system in the .prj is not understood: save the shapes in WGS 84 (EPSG:4326).'),
    );
  }
}

class ShapeReader {
  readonly #convert: (at: Position) => Position;
  #points = 0;

  constructor(convert: (at: Position) => Position) {
    this.#convert = convert;
  }

  /** Kinds with heights are 10 above those without, those with measures 20. */
  shape(view: DataView): JsonObject | null {
    try {
      const kind = view.getInt32(0, true);
      const hasHeights = kind > 10 && kind < 20;
      const from = hasHeights ? { [HEIGHTS_FROM]: FRAME.GLOBAL } : {};
      switch (kind % 10) {
        case NO_SHAPE:
          return null;
        case 1: {
          const height = hasHeights ? [view.getFloat64(20, true)] : [];
          return { type: 'Point', coordinates: [...this.#position(view, 4), ...height], ...from };
        }
        case 8: {
          const count = this.#counted(view.getInt32(36, true));
          const heightsAt = hasHeights ? 40 + 16 * count + 16 : null;
          return { type: 'MultiPoint', coordinates: this.#run(view, 40, 0, count, heightsAt), ...from };
        }
        case 3:
          return { type: 'MultiLineString', coordinates: this.#parts(view, hasHeights), ...from };
        case 5:
          return { type: 'MultiPolygon', coordinates: outlinesOf(this.#parts(view, false)) };
        default:
          return { type: `${kind}` };
      }
    } catch (error) {
      if (error instanceof RangeError) throw damaged();
      throw error;
    }
  }

  #counted(count: number): number {
    this.#points += count;
    if (count < 0) throw damaged();
    if (this.#points <= MAX_POINTS) return count;
    throw new NotAPlanFile(t('These shapes have more than {most} points: they are no plan.', { most: MAX_POINTS }));
  }

  #position(view: DataView, at: number): Position {
    return this.#convert([view.getFloat64(at, true), view.getFloat64(at + 8, true)]);
  }

  #run(view: DataView, pointsAt: number, first: number, end: number, heightsAt: number | null): Ring {
    const ring: Ring = [];
    for (let point = first; point < end; point += 1) {
      const position = this.#position(view, pointsAt + 16 * point);
      if (heightsAt !== null) position[2] = view.getFloat64(heightsAt + 8 * point, true);
      ring.push(position);
    }
    return ring;
  }

  #parts(view: DataView, hasHeights: boolean): Ring[] {
    const [parts, points] = [view.getInt32(36, true), this.#counted(view.getInt32(40, true))];
    if (parts < 0) throw damaged();
    if (parts > MAX_RINGS) {
      throw new NotAPlanFile(t('A shape has more than {most} parts: it is no plan.', { most: MAX_RINGS }));
    }
    const starts = Array.from({ length: parts }, (_, part) => view.getInt32(44 + 4 * part, true));
    const pointsAt = 44 + 4 * parts;
    const heightsAt = hasHeights ? pointsAt + 16 * points + 16 : null;
    return starts.map((start, part) => {
      const end = starts[part + 1] ?? points;
      if (start < 0 || end < start || end > points) throw damaged();
      return this.#run(view, pointsAt, start, end, heightsAt);
    });
  }
}

/** Above 0: clockwise, as outlines are; holes are not. */
const turn = (ring: Ring): number =>
  ring.reduce((sum, [x, y], at) => {
    const [nextX, nextY] = ring[(at + 1) % ring.length]!;
    return sum + (nextX! - x!) * (nextY! + y!);
  }, 0);

function contains(ring: Ring, [x, y]: Position): boolean {
  let isInside = false;
  for (const [at, [ax, ay]] of ring.entries()) {
    const [bx, by] = ring[(at + 1) % ring.length]!;
    if (ay! > y! !== by! > y! && x! < ((bx! - ax!) * (y! - ay!)) / (by! - ay!) + ax!) isInside = !isInside;
  }
  return isInside;
}

/** A hole belongs to the smallest outline around it; without one it is an outline itself. */
function outlinesOf(rings: readonly Ring[]): Ring[][] {
  const outlines = rings
    .filter((ring) => turn(ring) >= 0)
    .map((ring) => ({ ring, size: turn(ring), holes: [] as Ring[] }))
    .sort((one, other) => one.size - other.size);
  for (const hole of rings.filter((ring) => turn(ring) < 0)) {
    const around = outlines.find(({ ring, size }) => size > -turn(hole) && contains(ring, hole[0]!));
    if (around) around.holes.push(hole);
    else outlines.push({ ring: hole, size: -turn(hole), holes: [] });
  }
  return outlines.map(({ ring, holes }) => [ring, ...holes]);
}
