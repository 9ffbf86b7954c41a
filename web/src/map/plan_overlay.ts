/**
 * The canvas of a plan, below the drones' canvas: legs with their direction, numbered items, fence, rally points, the
 * current drawing.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { Place } from '../link/messages';
import type { Hit } from '../plan/drawing';
import { MapCanvas, type Sheet } from './map_canvas';
import { drawFence } from './plan_fence';
import { drawCrossing, drawHandle, drawItem, drawRally, drawReturn, ITEM_RADIUS_PX } from './plan_markers';
import { hitAt, isLong, NO_PLAN, type PlanScene, type SceneDraft } from './plan_scene';
import type { Point } from './projection';
import { readTheme, type MapTheme } from './theme';

const REACH_PX = 14;
const TOUCH_REACH_PX = 24;
/** Closer than this to a drawn item, an item is a dot: overlapping numbers are unreadable. */
const CROWDED_PX = 19;
const ARROW_FROM_PX = 44;

export class PlanOverlay {
  readonly #canvas: MapCanvas;
  #theme: MapTheme = readTheme();
  #scene: PlanScene = NO_PLAN;
  #pointer: Place | null = null;

  constructor(map: MapLibreMap) {
    // Directly above the ground: drones fly over plans.
    this.#canvas = new MapCanvas(map, { isLowest: true, testId: 'plan-canvas', paint: (sheet) => this.#draw(sheet) });
  }

  set scene(scene: PlanScene) {
    this.#scene = scene;
    this.#canvas.soon();
  }

  /** Where the next corner would go; null: the pointer is elsewhere. */
  set pointer(place: Place | null) {
    if (!this.#pointer && !place) return;
    this.#pointer = place;
    this.#canvas.soon();
  }

  renewTheme(): void {
    this.#theme = readTheme();
    this.#canvas.soon();
  }

  hit(x: number, y: number, isTouch: boolean): Hit | null {
    const projection = this.#canvas.projection();
    return hitAt(this.#scene, {
      at: (place) => projection.at(place),
      x,
      y,
      reachPx: isTouch ? TOUCH_REACH_PX : REACH_PX,
    });
  }

  remove(): void {
    this.#canvas.remove();
  }

  #draw({ pen, projection, widthPx: width, heightPx: height }: Sheet): void {
    const at = (place: Place): Point => projection.at(place);
    const [theme, scene] = [this.#theme, this.#scene];
    const isNear = ({ x, y }: Point, margin = 40): boolean =>
      x > -margin && y > -margin && x < width + margin && y < height + margin;
    pen.lineJoin = 'round';
    pen.lineCap = 'round';
    drawFence(pen, theme, scene, at);
    this.#drawLegs(at, width, height);
    if (scene.draft) this.#drawDraft(scene.draft, at);
    for (const place of scene.crossings) drawCrossing(pen, theme, at(place));
    if (scene.returnPoint) drawReturn(pen, theme, at(scene.returnPoint));
    if (scene.home) drawHandle(pen, theme, at(scene.home), 'home', false);
    for (const point of scene.rally) drawRally(pen, theme, at(point.place), point);

    // The selected and the current item first: they always show their number.
    const isAlone = scene.items.filter(({ isSelected }) => isSelected).length === 1;
    const weight = (one: (typeof scene.items)[number]): number => Number(one.isSelected) + 2 * Number(one.isCurrent);
    const taken: Point[] = [];
    const drawn = [...scene.items].sort((one, other) => weight(other) - weight(one));
    const isFree = (point: Point): boolean =>
      taken.every((other) => Math.abs(other.x - point.x) > CROWDED_PX || Math.abs(other.y - point.y) > CROWDED_PX);
    const whole: [(typeof drawn)[number], Point][] = [];
    for (const item of drawn) {
      const stands = at(item.place);
      const point = { x: stands.x, y: stands.y - item.liftPx };
      if (!isNear(point)) continue;
      const hasRoom = (item.isSelected && isAlone) || item.isCurrent || isFree(point);
      if (!hasRoom) {
        drawItem(pen, theme, point, item, true, 0);
        continue;
      }
      taken.push(point);
      whole.push([item, point]);
    }
    for (const [item, point] of whole.reverse()) {
      const radiusPx = item.radiusM > 0 ? item.radiusM * this.#pxPerM(item.place, at) : 0;
      drawItem(pen, theme, point, item, false, radiusPx);
    }
  }

  #pxPerM(place: Place, at: (place: Place) => Point): number {
    const north = { ...place, latDeg: place.latDeg + 1000 / 111_195 };
    return Math.abs(at(north).y - at(place).y) / 1000;
  }

  /** One stroke for each kind: hundreds of strokes slow a map down. */
  #drawLegs(at: (place: Place) => Point, width: number, height: number): void {
    const [pen, theme, scene] = [this.#canvas.pen, this.#theme, this.#scene];
    const margin = 8;
    const isBeside = (a: Point, b: Point): boolean =>
      Math.max(a.x, b.x) < -margin ||
      Math.max(a.y, b.y) < -margin ||
      Math.min(a.x, b.x) > width + margin ||
      Math.min(a.y, b.y) > height + margin;
    const legs = scene.legs.flatMap((leg) => {
      const [a, b] = [at(leg.from), at(leg.to)];
      return isBeside(a, b) ? [] : [{ a, b, leg, isDashed: leg.isJump || leg.at === null }];
    });
    const stroke = (some: typeof legs, colour: string, widthPx: number, dash: number[]): void => {
      if (some.length === 0) return;
      pen.beginPath();
      for (const { a, b } of some) {
        pen.moveTo(a.x, a.y);
        pen.lineTo(b.x, b.y);
      }
      pen.setLineDash(dash);
      pen.strokeStyle = colour;
      pen.lineWidth = widthPx;
      pen.stroke();
    };
    stroke(legs, theme.halo, 5, []);
    for (const isForbidden of [false, true]) {
      for (const isDashed of [false, true]) {
        const alike = legs.filter((one) => one.leg.isForbidden === isForbidden && one.isDashed === isDashed);
        stroke(alike, isForbidden ? theme.danger : theme.way, isForbidden ? 3 : 2, isDashed ? [7, 6] : []);
      }
    }
    pen.setLineDash([]);
    for (const { a, b, leg } of legs) {
      this.#drawArrow(a, b, leg.isForbidden ? theme.danger : theme.way);
      if (!scene.showsHandles || leg.at === null || !isLong(a, b)) continue;
      drawHandle(pen, theme, { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 }, 'plus', false);
    }
  }

  /** Past the middle, because the handle is there. */
  #drawArrow(a: Point, b: Point, colour: string): void {
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length < ARROW_FROM_PX) return;
    const { pen } = this.#canvas;
    const part = Math.max(0.5, Math.min(0.72, 1 - (ITEM_RADIUS_PX + 12) / length));
    pen.save();
    pen.translate(a.x + (b.x - a.x) * part, a.y + (b.y - a.y) * part);
    pen.rotate(Math.atan2(b.y - a.y, b.x - a.x));
    pen.beginPath();
    pen.moveTo(7, 0);
    pen.lineTo(-5, -5.5);
    pen.lineTo(-2, 0);
    pen.lineTo(-5, 5.5);
    pen.closePath();
    pen.fillStyle = colour;
    pen.strokeStyle = this.#theme.halo;
    pen.lineWidth = 2;
    pen.stroke();
    pen.fill();
    pen.restore();
  }

  #drawDraft(draft: SceneDraft, at: (place: Place) => Point): void {
    const [pen, theme] = [this.#canvas.pen, this.#theme];
    const points = draft.points.map(at);
    const [first] = points;
    if (!first) return;
    if (draft.preview.length > 1) {
      pen.beginPath();
      for (const place of draft.preview) {
        const { x, y } = at(place);
        pen.lineTo(x, y);
      }
      pen.strokeStyle = theme.halo;
      pen.lineWidth = 4;
      pen.stroke();
      pen.strokeStyle = theme.way;
      pen.lineWidth = 1.5;
      pen.stroke();
      pen.beginPath();
      for (const [from, to] of draft.outside) {
        const [start, end] = [at(from), at(to)];
        pen.moveTo(start.x, start.y);
        pen.lineTo(end.x, end.y);
      }
      pen.strokeStyle = theme.danger;
      pen.lineWidth = 2.5;
      pen.stroke();
      const ends = [draft.preview[0]!, draft.preview.at(-1)!].map(at);
      for (const [number, end] of ends.entries()) drawHandle(pen, theme, end, number === 0 ? 'begin' : 'end', false);
    }
    if (draft.rim) {
      const rim = at(draft.rim);
      drawHandle(pen, theme, first, 'corner', false);
      drawHandle(pen, theme, rim, 'corner', false);
      return;
    }
    const pointer = this.#pointer && !draft.isWhole ? at(this.#pointer) : null;
    pen.beginPath();
    for (const { x, y } of pointer ? [...points, pointer] : points) pen.lineTo(x, y);
    if (!draft.isLine && (draft.isWhole || points.length > 2)) pen.closePath();
    if (!draft.isLine) {
      pen.save();
      pen.globalAlpha = 0.12;
      pen.fillStyle = theme.accent;
      pen.fill();
      pen.restore();
    }
    pen.strokeStyle = theme.accent;
    pen.lineWidth = 2;
    pen.setLineDash(draft.isWhole ? [] : [6, 5]);
    pen.stroke();
    pen.setLineDash([]);
    const corner = this.#scene.corner;
    for (const [number, point] of points.entries()) {
      const isChosen = corner?.of === 'draft' && corner.at === number;
      drawHandle(pen, theme, point, 'corner', isChosen);
      const next = points[number + 1] ?? (draft.isWhole && !draft.isLine ? points[0] : undefined);
      if (next && isLong(point, next)) {
        drawHandle(pen, theme, { x: (point.x + next.x) / 2, y: (point.y + next.y) / 2 }, 'plus', false);
      }
    }
  }
}
