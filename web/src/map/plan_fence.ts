/** A fence on the map: an inclusion area has an outline only, an exclusion area is hatched. */

import type { Place } from '../link/messages';
import { drawHandle } from './plan_markers';
import { isLong, type PlanScene, type SceneShape } from './plan_scene';
import type { Point } from './projection';
import type { MapTheme } from './theme';

type Pen = CanvasRenderingContext2D;

const HATCH_PX = 12;

function outline(pen: Pen, shape: SceneShape, at: (place: Place) => Point): Point[] {
  pen.beginPath();
  if ('corners' in shape) {
    const ring = shape.corners.map(at);
    for (const { x, y } of ring) pen.lineTo(x, y);
    pen.closePath();
    return ring;
  }
  const [centre, rim] = [at(shape.centre), at(shape.rim)];
  const radius = Math.hypot(rim.x - centre.x, rim.y - centre.y);
  pen.arc(centre.x, centre.y, radius, 0, 2 * Math.PI);
  return [
    { x: centre.x - radius, y: centre.y - radius },
    { x: centre.x + radius, y: centre.y + radius },
  ];
}

export function drawFence(pen: Pen, theme: MapTheme, scene: PlanScene, at: (place: Place) => Point): void {
  for (const shape of scene.shapes) {
    const colour = shape.isIn ? theme.good : theme.danger;
    pen.save();
    const reach = outline(pen, shape, at);
    pen.globalAlpha = shape.isIn ? 0.06 : 0.1;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 1;
    if (!shape.isIn) hatch(pen, reach, colour);
    pen.restore();
    outline(pen, shape, at);
    pen.strokeStyle = theme.halo;
    pen.lineWidth = 5;
    pen.stroke();
    pen.strokeStyle = colour;
    pen.lineWidth = shape.isSelected ? 3 : 2;
    pen.setLineDash(shape.isIn ? [] : [9, 5]);
    pen.stroke();
    pen.setLineDash([]);
  }
  for (const shape of scene.shapes) if (shape.isSelected) drawHandles(pen, theme, scene, shape, at);
}

/** Diagonal lines inside the last traced outline. */
function hatch(pen: Pen, reach: readonly Point[], colour: string): void {
  const xs = reach.map(({ x }) => x);
  const ys = reach.map(({ y }) => y);
  const [left, right] = [Math.max(-200, Math.min(...xs)), Math.min(4000, Math.max(...xs))];
  const [top, bottom] = [Math.max(-200, Math.min(...ys)), Math.min(4000, Math.max(...ys))];
  const height = bottom - top;
  pen.clip();
  pen.beginPath();
  for (let x = left - height; x < right; x += HATCH_PX) {
    pen.moveTo(x, bottom);
    pen.lineTo(x + height, top);
  }
  pen.strokeStyle = colour;
  pen.globalAlpha = 0.35;
  pen.lineWidth = 1;
  pen.stroke();
}

function drawHandles(
  pen: Pen,
  theme: MapTheme,
  scene: PlanScene,
  shape: SceneShape,
  at: (place: Place) => Point,
): void {
  if (!('corners' in shape)) {
    drawHandle(pen, theme, at(shape.centre), 'corner', false);
    drawHandle(pen, theme, at(shape.rim), 'corner', false);
    return;
  }
  const ring = shape.corners.map(at);
  for (const [number, point] of ring.entries()) {
    const next = ring[(number + 1) % ring.length]!;
    if (isLong(point, next)) {
      drawHandle(pen, theme, { x: (point.x + next.x) / 2, y: (point.y + next.y) / 2 }, 'plus', false);
    }
    drawHandle(pen, theme, point, 'corner', scene.corner?.of === shape.id && scene.corner.at === number);
  }
}
