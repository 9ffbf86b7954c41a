/**
 * Where the names of drones stand so that none covers another: beside its marker, further off with a leader line, or
 * nowhere for want of room. Pure; all in pixels of the screen. Those that come first choose first.
 */

import { Obstacles, type Box } from './obstacles';

export interface LabelWanted {
  readonly id: number;
  /** The middle of the marker. */
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
  /** Of its own marker with all that is drawn around it, where that is more than others have. */
  readonly radiusPx?: number;
}

export interface LabelPlace {
  /** The left end and the middle of the label's height. */
  readonly x: number;
  readonly y: number;
  /** Which of the candidate places it has: hand it back next time, so that names do not jump about. */
  readonly slot: number;
  /** Too far from its marker to be understood without a line. */
  readonly isFar: boolean;
}

/** Direction of each candidate: right first, because that is where people look. */
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
const BREATH_PX = 2;

function place({ x, y, width, height }: LabelWanted, slot: number, radiusPx: number): LabelPlace {
  const [east, south] = DIRECTIONS[slot % DIRECTIONS.length]!;
  const isFar = slot >= DIRECTIONS.length;
  const away = radiusPx + (isFar ? FAR_PX : 0);
  const left = east > 0 ? x + away : east < 0 ? x - away - width : x - width / 2;
  const middle = y + south * (away * (east === 0 ? 1 : 0.6) + height / 2);
  return { x: left, y: middle, slot, isFar };
}

const boxOf = (at: LabelPlace, { width, height }: LabelWanted): Box => ({
  left: at.x - BREATH_PX,
  right: at.x + width + BREATH_PX,
  top: at.y - height / 2,
  bottom: at.y + height / 2,
});

const NEAR_SLOTS = DIRECTIONS.length;
const SLOTS: readonly number[] = [...Array(2 * NEAR_SLOTS).keys()];

/**
 * `radiusPx`: of a marker with its margin; names do not cover other drones' markers either, nor what is `inTheWay`.
 * `last`: the slots of the time before. A name without a place is not in the answer.
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
    // Its old place is kept while it is free, unless that was a far one and a near one may have come free.
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
