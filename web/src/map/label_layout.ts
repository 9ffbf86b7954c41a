/**
 * Places drones' names so that they do not overlap: beside the marker, further off with a leader line, or nowhere for
 * lack of room. Pure; all in screen pixels. Earlier drones choose first.
 */

import { Obstacles, type Box } from './obstacles';

export interface LabelWanted {
  readonly id: number;
  /** The centre of the marker. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  /** Radius of its own marker with everything drawn around it, if larger than usual. */
  readonly radiusPx?: number;
}

export interface LabelPlace {
  /** The left end, at the vertical middle of the label. */
  readonly x: number;
  readonly y: number;
  /** The index of its place: pass it back next time, so that names do not jump. */
  readonly slot: number;
  /** So far from its marker that it needs a leader line. */
  readonly isFar: boolean;
}

/** Direction of each candidate: right first, because people look there. */
const DIRECTIONS: readonly (readonly [number, number])[] = [
  [1, 0],
  [-1, 0],
  [0, 1],
  [0, -1],
  [1, 1],
  [-1, 1],
  [1, -1],
  [-1, -1],
];
const FAR_PX = 22;
const LABEL_GAP_PX = 2;

function place({ x, y, width, height }: LabelWanted, slot: number, radiusPx: number): LabelPlace {
  const [east, south] = DIRECTIONS[slot % DIRECTIONS.length]!;
  const isFar = slot >= DIRECTIONS.length;
  const away = radiusPx + (isFar ? FAR_PX : 0);
  const left = east > 0 ? x + away : east < 0 ? x - away - width : x - width / 2;
  const middle = y + south * (away * (east === 0 ? 1 : 0.6) + height / 2);
  return { x: left, y: middle, slot, isFar };
}

const boxOf = (at: LabelPlace, { width, height }: LabelWanted): Box => ({
  left: at.x - LABEL_GAP_PX,
  right: at.x + width + LABEL_GAP_PX,
  top: at.y - height / 2,
  bottom: at.y + height / 2,
});

const NEAR_SLOTS = DIRECTIONS.length;
const SLOTS: readonly number[] = [...Array(2 * NEAR_SLOTS).keys()];

/**
 * `radiusPx`: radius of a marker with its margin; names avoid other drones' markers, and what is `inTheWay`. `last`:
 * the previous slots. The result omits names without a place.
 */
export function layoutLabels(
  wanted: readonly LabelWanted[],
  radiusPx: number,
  last: ReadonlyMap<number, number>,
  inTheWay: readonly Box[] = [],
): Map<number, LabelPlace> {
  const obstacles = new Obstacles();
  const half = radiusPx * 0.6;
  for (const { id, x, y } of wanted)
    obstacles.add({ left: x - half, right: x + half, top: y - half, bottom: y + half }, id);
  for (const box of inTheWay) obstacles.add(box);
  const places = new Map<number, LabelPlace>();
  for (const one of wanted) {
    const before = last.get(one.id);
    // Keeps its place while that is free, unless it was a far one and a near one may now be free.
    const slots = before !== undefined && before < NEAR_SLOTS ? [before, ...SLOTS] : SLOTS;
    for (const slot of slots) {
      const at = place(one, slot, one.radiusPx ?? radiusPx);
      const box = boxOf(at, one);
      if (!obstacles.isFree(box, one.id)) continue;
      obstacles.add(box);
      places.set(one.id, at);
      break;
    }
  }
  return places;
}
