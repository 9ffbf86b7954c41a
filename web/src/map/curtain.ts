/** On a tilted map: a light curtain from a track down to the ground, by which its height can be read. */

import type { Place } from '../link/messages';
import type { Point, Projection } from './projection';

/** `upM`: above home; absent: on the ground. */
export interface TrackPlace extends Place {
  readonly upM?: number;
}

const STEP_PX = 5;
const STEM_STEP_PX = 28;

export const trackPoint = (projection: Projection, place: TrackPlace): Point =>
  place.upM === undefined ? projection.at(place) : projection.aboveHome(place, place.upM);

export function drawCurtain(
  pen: CanvasRenderingContext2D,
  projection: Projection,
  way: Iterable<TrackPlace>,
  colour: string,
  alpha: number,
): void {
  const areas = new Path2D();
  const lines = new Path2D();
  let lastTop: Point | null = null;
  let lastFoot: Point | null = null;
  let stemFoot: Point | null = null;
  const hang = (place: TrackPlace, isEnd: boolean): void => {
    const top = trackPoint(projection, place);
    if (lastTop && !isEnd && isNear(top, lastTop, STEP_PX)) return;
    const foot = projection.at(place);
    if (lastTop && lastFoot) {
      addArea(areas, [lastTop, top, foot, lastFoot]);
      lines.moveTo(lastFoot.x, lastFoot.y);
      lines.lineTo(foot.x, foot.y);
    }
    // Above one place a single stem: a climb has no others beside it.
    if (!stemFoot || isEnd || !isNear(foot, stemFoot, STEM_STEP_PX)) {
      lines.moveTo(top.x, top.y);
      lines.lineTo(foot.x, foot.y);
      stemFoot = foot;
    }
    [lastTop, lastFoot] = [top, foot];
  };
  let next: TrackPlace | null = null;
  for (const place of way) {
    if (next) hang(next, false);
    next = place;
  }
  if (next) hang(next, true);
  pen.fillStyle = pen.strokeStyle = colour;
  pen.globalAlpha = alpha * 0.3;
  pen.fill(areas);
  pen.globalAlpha = alpha * 0.7;
  pen.lineWidth = 1;
  pen.stroke(lines);
  pen.globalAlpha = 1;
}

/** All turn one way: where two overlap, the rule of windings must not make a hole. */
function addArea(path: Path2D, corners: readonly Point[]): void {
  const ordered = clockwise(corners);
  path.moveTo(ordered[0]!.x, ordered[0]!.y);
  for (const { x, y } of ordered.slice(1)) path.lineTo(x, y);
  path.closePath();
}

export function clockwise(corners: readonly Point[]): readonly Point[] {
  let twice = 0;
  for (const [index, { x, y }] of corners.entries()) {
    const next = corners[(index + 1) % corners.length]!;
    twice += x * next.y - next.x * y;
  }
  return twice >= 0 ? corners : corners.toReversed();
}

const isNear = (one: Point, other: Point, withinPx: number): boolean =>
  Math.abs(one.x - other.x) < withinPx && Math.abs(one.y - other.y) < withinPx;
