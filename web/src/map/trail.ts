/** Trails for the screen: those behind and ahead, thinned, as points that coincide cost strokes and are invisible. Pure. */

import { trackPoint, type TrackPlace } from './curtain';
import type { Point, Projection } from './projection';

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

/** The first `passed` points, and where the drone is. One by one: lists of a long way, made anew for each picture, would
 * be most of a replay's garbage. */
export function* wayBehind(track: readonly TrackPlace[], passed: number, place: TrackPlace): Generator<TrackPlace> {
  for (let at = 0; at < passed; at++) yield track[at]!;
  yield place;
}

/** From where the drone is, the points after the first `passed`. */
export function* wayAhead(track: readonly TrackPlace[], passed: number, place: TrackPlace): Generator<TrackPlace> {
  yield place;
  for (let at = passed; at < track.length; at++) yield track[at]!;
}

export function* pointsOf(projection: Projection, way: Iterable<TrackPlace>): Generator<Point> {
  for (const place of way) yield trackPoint(projection, place);
}
