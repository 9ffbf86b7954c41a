/** Splits an area for several drones: parallel strips along the survey's lines, all of the same size. */

import { bboxClip } from '@turf/bbox-clip';

import { t } from '../../languages/text';
import type { Point } from '../ground';
import type { Spot } from '../plan_types';
import { Drawing, heldToOutline, SurveyFault } from './area';

export const MAX_PARTS = 50;

function sizeOf(ring: readonly Point[]): number {
  let twice = 0;
  for (const [at, [x1, y1]] of ring.entries()) {
    const [x2, y2] = ring[(at + 1) % ring.length]!;
    twice += x1 * y2 - x2 * y1;
  }
  return Math.abs(twice) / 2;
}

interface Box {
  readonly west: number;
  readonly south: number;
  readonly east: number;
  readonly north: number;
}

/** The part of the outline between two heights. Separate pieces are joined by a line along the cut. */
function strip(ring: readonly Point[], box: Box, from: number, to: number): Point[] {
  const coordinates = [[...ring, ring[0]!].map((corner) => [...corner])];
  const clipped = bboxClip({ type: 'Polygon', coordinates }, [box.west - 1, from, box.east + 1, to]);
  const [outline = []] = clipped.geometry.coordinates as number[][][];
  return outline.slice(0, -1).map(([x, y]): Point => [x!, y!]);
}

/** Fine enough for a hundredth of a square metre in a square of a hundred kilometres. */
const HALVINGS = 60;

/** `angleDeg`: angle of the lines; strips run along it, so that no line is cut. */
export function splitArea(drawn: readonly Spot[], parts: number, angleDeg: number): Spot[][] {
  const area = heldToOutline(drawn);
  if (!Number.isInteger(parts) || parts < 1 || parts > MAX_PARTS) {
    throw new SurveyFault(t('An area is split into 1 to {maxParts} parts.', { maxParts: MAX_PARTS }));
  }
  const drawing = new Drawing(area, angleDeg);
  const ring = area.map((corner) => drawing.point(corner));
  const xs = ring.map(([x]) => x);
  const ys = ring.map(([, y]) => y);
  const box = { west: Math.min(...xs), south: Math.min(...ys), east: Math.max(...xs), north: Math.max(...ys) };
  const whole = sizeOf(ring);
  const cuts = [box.south];
  for (let part = 1; part < parts; part += 1) {
    let [low, high] = [cuts.at(-1)!, box.north];
    for (let step = 0; step < HALVINGS; step += 1) {
      const middle = (low + high) / 2;
      if (sizeOf(strip(ring, box, box.south, middle)) < (whole * part) / parts) low = middle;
      else high = middle;
    }
    cuts.push((low + high) / 2);
  }
  cuts.push(box.north);
  return cuts.slice(1).map((to, at) => strip(ring, box, cuts[at]!, to).map((corner) => drawing.spot(corner)));
}
