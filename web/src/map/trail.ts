/** Thins trails for the screen: points that coincide cost strokes and are invisible. Pure. */

import type { Point } from './projection';

/** A point closer than this to the last one is dropped. */
export const TRAIL_STEP_PX = 3;

/** The first and the last point are always kept. */
export function thinned(points: Iterable<Point>, stepPx = TRAIL_STEP_PX): Point[] {
  const kept: Point[] = [];
  let newest: Point | null = null;
  for (const point of points) {
    newest = point;
    const last = kept.at(-1);
    if (!last || Math.abs(point.x - last.x) >= stepPx || Math.abs(point.y - last.y) >= stepPx) kept.push(point);
  }
  if (newest && newest !== kept.at(-1)) kept.push(newest);
  return kept;
}
