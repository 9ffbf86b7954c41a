/** A plan as a map scene, and hit testing under the pointer. Pure: the canvas is plan_overlay.ts. */

import type { Place } from '../link/messages';
import { CMD, specOf } from '../plan/catalogue';
import type { CornerOwner, Drawing, Hit } from '../plan/drawing';
import { isNoPlace } from '../plan/field_checks';
import type { FlownPath } from '../plan/flown_path';
import { spotAt } from '../plan/ground';
import { cleanOutline, crossingsOf } from '../plan/outline';
import { latDegOf, lonDegOf, type PartId, type Plan, type Spot, type WireItem } from '../plan/plan_types';
import type { Point } from './projection';

export type ItemSign = 'way' | 'takeoff' | 'land' | 'look' | 'loiter';

export interface SceneItem {
  readonly id: PartId;
  readonly label: string;
  readonly place: Place;
  readonly sign: ItemSign;
  /** Drawn this many pixels above its place: a take-off would cover home. */
  readonly liftPx: number;
  /** Radius of the circle that it flies; 0: none. */
  readonly radiusM: number;
  readonly isSelected: boolean;
  readonly isCurrent: boolean;
  readonly isReached: boolean;
  readonly hasFault: boolean;
}

export interface SceneLeg {
  readonly from: Place;
  readonly to: Place;
  /** The index of an item inserted here; null: not possible. */
  readonly at: number | null;
  readonly isJump: boolean;
  readonly isForbidden: boolean;
}

export type SceneShape =
  | { readonly id: PartId; readonly isIn: boolean; readonly isSelected: boolean; readonly corners: readonly Place[] }
  | {
      readonly id: PartId;
      readonly isIn: boolean;
      readonly isSelected: boolean;
      readonly centre: Place;
      readonly radiusM: number;
      readonly rim: Place;
    };

export interface SceneDraft {
  readonly points: readonly Place[];
  readonly isWhole: boolean;
  readonly isLine: boolean;
  readonly rim: Place | null;
  readonly radiusM: number;
  /** The path that would be flown. */
  readonly preview: readonly Place[];
  /** The parts of it that leave the area. */
  readonly outside: readonly (readonly [Place, Place])[];
}

export interface PlanScene {
  readonly items: readonly SceneItem[];
  readonly legs: readonly SceneLeg[];
  readonly shapes: readonly SceneShape[];
  readonly rally: readonly {
    readonly id: PartId;
    readonly label: string;
    readonly place: Place;
    readonly isSelected: boolean;
  }[];
  readonly home: Place | null;
  readonly returnPoint: Place | null;
  readonly draft: SceneDraft | null;
  /** Where a border or the drawn outline crosses itself. */
  readonly crossings: readonly Place[];
  readonly corner: { readonly of: CornerOwner; readonly at: number } | null;
  /** Leg midpoints have handles to drag. */
  readonly showsHandles: boolean;
}

export const NO_PLAN: PlanScene = {
  items: [],
  legs: [],
  shapes: [],
  rally: [],
  home: null,
  returnPoint: null,
  draft: null,
  crossings: [],
  corner: null,
  showsHandles: false,
};

export const placeOf = (spot: Spot): Place => ({ latDeg: latDegOf(spot), lonDeg: lonDegOf(spot) });
export const spotOfItem = (item: WireItem): Spot => ({ latE7: item.x, lonE7: item.y });

const TAKEOFF_LIFT_PX = 26;

function signOf(command: number): ItemSign {
  switch (command) {
    case CMD.TAKEOFF:
    case CMD.VTOL_TAKEOFF:
      return 'takeoff';
    case CMD.LAND:
    case CMD.VTOL_LAND:
      return 'land';
    case CMD.ROI:
    case CMD.ROI_LOCATION:
      return 'look';
    case CMD.LOITER_TIME:
    case CMD.LOITER_TURNS:
    case CMD.LOITER_UNLIMITED:
    case CMD.LOITER_TO_HEIGHT:
      return 'loiter';
    default:
      return 'way';
  }
}

function circleOf(item: WireItem): number {
  if (item.command === CMD.LOITER_TURNS || item.command === CMD.LOITER_UNLIMITED || item.command === CMD.LOITER_TIME) {
    return Math.abs(item.params[2] ?? 0);
  }
  return item.command === CMD.LOITER_TO_HEIGHT ? Math.abs(item.params[1] ?? 0) : 0;
}

export interface Shown {
  readonly plan: Plan;
  readonly path: FlownPath;
  readonly drawing: Drawing;
  readonly preview: readonly WireItem[];
  /** The parts of the preview that leave the area. */
  readonly outside?: readonly (readonly [Spot, Spot])[];
  /** Items with an error. */
  readonly faults: ReadonlySet<PartId>;
  /** Legs that cross the fence. */
  readonly forbidden: ReadonlySet<number>;
  readonly current: number | null;
  readonly reached: ReadonlySet<number>;
}

/** An item without its own place (a take-off "here") is drawn where the drone is at that point. */
export function planScene(shown: Shown): PlanScene {
  const { plan, path, drawing, preview, outside = [], faults, forbidden, current, reached } = shown;
  const stands = new Map<number, Spot>();
  for (const leg of path.legs) if (!stands.has(leg.seq)) stands.set(leg.seq, leg.to);
  const items = plan.items.flatMap((item, seq): SceneItem[] => {
    const own = spotOfItem(item);
    const spec = specOf(item.command);
    const hasPlace = (spec?.place ?? 'none') !== 'none';
    if (!hasPlace || item.command === CMD.RETURN) return [];
    const spot = isNoPlace(own) ? stands.get(seq) : own;
    if (!spot) return [];
    return [
      {
        id: item.id,
        label: `${seq + 1}`,
        place: placeOf(spot),
        sign: signOf(item.command),
        liftPx: isNoPlace(own) && signOf(item.command) === 'takeoff' ? TAKEOFF_LIFT_PX : 0,
        radiusM: circleOf(item),
        isSelected: drawing.selected.has(item.id),
        isCurrent: seq === current,
        isReached: reached.has(seq),
        hasFault: faults.has(item.id),
      },
    ];
  });
  const shapes = plan.fence.shapes.map((shape): SceneShape => {
    const common = { id: shape.id, isIn: shape.inclusion, isSelected: drawing.selected.has(shape.id) };
    if (shape.shape === 'polygon') return { ...common, corners: shape.corners.map(placeOf) };
    const { centre, radiusM } = shape;
    return { ...common, centre: placeOf(centre), radiusM, rim: placeOf(spotAt(centre, radiusM, 90)) };
  });
  return {
    items,
    legs: legsOf(plan, path, forbidden),
    shapes,
    rally: plan.rally.map((point, at) => ({
      id: point.id,
      label: `R${at + 1}`,
      place: placeOf(point.spot),
      isSelected: drawing.selected.has(point.id),
    })),
    home: plan.home && placeOf(plan.home.spot),
    returnPoint: plan.fence.returnPoint && placeOf(plan.fence.returnPoint.spot),
    draft: draftOf(drawing, preview, outside),
    crossings: crossedOutlines(plan, drawing).flatMap((corners) =>
      crossingsOf(cleanOutline(corners).corners).map(({ spot }) => placeOf(spot)),
    ),
    corner: drawing.corner,
    showsHandles: drawing.tool === 'select' || drawing.tool === 'item',
  };
}

/** Every outline: a line may cross itself. */
function crossedOutlines({ fence }: Plan, { tool, draft, isWhole }: Drawing): (readonly Spot[])[] {
  const borders = fence.shapes.flatMap((shape) => (shape.shape === 'polygon' ? [shape.corners] : []));
  return tool === 'survey' && isWhole ? [...borders, draft] : borders;
}

/** Each leg once, however often a jump repeats it. */
function legsOf(plan: Plan, path: FlownPath, forbidden: ReadonlySet<number>): SceneLeg[] {
  const drawn = new Set<string>();
  const legs: SceneLeg[] = [];
  let before = -1;
  for (const { seq, from, to, lengthM } of path.legs) {
    const isJump = seq <= before;
    const isStart = before < 0 && plan.home !== null;
    before = seq;
    if (lengthM < 0.1) continue;
    const key = `${from.latE7} ${from.lonE7} ${to.latE7} ${to.lonE7}`;
    if (drawn.has(key)) continue;
    drawn.add(key);
    const at = isJump || isStart ? null : seq;
    legs.push({ from: placeOf(from), to: placeOf(to), at, isJump, isForbidden: forbidden.has(seq) });
  }
  return legs;
}

function draftOf(
  { tool, draft, isWhole, radiusM }: Drawing,
  preview: readonly WireItem[],
  outside: readonly (readonly [Spot, Spot])[],
): SceneDraft | null {
  const [first] = draft;
  if (!first) return null;
  const rim = tool === 'orbit' ? placeOf(spotAt(first, radiusM, 90)) : null;
  const way = preview.filter((item) => specOf(item.command)?.flies).map((item) => placeOf(spotOfItem(item)));
  return {
    points: draft.map(placeOf),
    isWhole,
    isLine: tool === 'corridor',
    rim,
    radiusM,
    preview: way,
    outside: outside.map(([from, to]) => [placeOf(from), placeOf(to)] as const),
  };
}

// --- hit testing ---

export interface Pointing {
  readonly at: (place: Place) => Point;
  readonly x: number;
  readonly y: number;
  /** Larger for fingers. */
  readonly reachPx: number;
}

/** Shorter legs have no handle in the middle: it would hide them. */
export const HANDLE_FROM_PX = 64;

const middleOf = (a: Point, b: Point): Point => ({ x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 });

/** Nearest first within a kind; kinds in order of priority. */
export function hitAt(scene: PlanScene, { at, x, y, reachPx }: Pointing): Hit | null {
  const away = (point: Point): number => Math.hypot(point.x - x, point.y - y);
  const nearest = <T>(all: readonly T[], point: (one: T) => Point, reach = reachPx): T | null => {
    let [best, least]: [T | null, number] = [null, reach];
    for (const one of all) {
      const distance = away(point(one));
      if (distance <= least) [best, least] = [one, distance];
    }
    return best;
  };
  const { draft } = scene;
  if (draft) {
    const hit = draftHit(draft, at, nearest);
    if (hit) return hit;
  }
  const chosen = scene.shapes.filter(({ isSelected }) => isSelected);
  for (const shape of chosen) {
    const hit = handleHit(shape, at, nearest);
    if (hit) return hit;
  }
  const marker = ({ place, liftPx }: SceneItem): Point => {
    const stands = at(place);
    return { x: stands.x, y: stands.y - liftPx };
  };
  const selected = scene.items.filter(({ isSelected }) => isSelected);
  const item = nearest(selected, marker) ?? nearest(scene.items, marker);
  if (item) return { on: 'item', id: item.id };
  const rally = nearest(scene.rally, (one) => at(one.place));
  if (rally) return { on: 'rally', id: rally.id };
  if (scene.home && away(at(scene.home)) <= reachPx) return { on: 'home' };
  if (scene.returnPoint && away(at(scene.returnPoint)) <= reachPx) return { on: 'return' };
  if (scene.showsHandles) {
    const long = scene.legs.filter((leg) => leg.at !== null && isLong(at(leg.from), at(leg.to)));
    const leg = nearest(long, (one) => middleOf(at(one.from), at(one.to)), reachPx * 0.8);
    if (leg) return { on: 'leg', at: leg.at! };
  }
  for (const shape of scene.shapes)
    if (isOnOutline(shape, at, { x, y }, reachPx * 0.6)) return { on: 'shape', id: shape.id };
  return null;
}

type Nearest = <T>(all: readonly T[], point: (one: T) => Point, reach?: number) => T | null;

export const isLong = (a: Point, b: Point): boolean => Math.hypot(a.x - b.x, a.y - b.y) >= HANDLE_FROM_PX;

function draftHit(draft: SceneDraft, at: (place: Place) => Point, nearest: Nearest): Hit | null {
  if (draft.rim) {
    if (nearest([draft.rim], at)) return { on: 'draft-rim' };
    return nearest(draft.points, at) ? { on: 'draft-centre' } : null;
  }
  return ringHit('draft', draft.points, !draft.isLine && draft.isWhole, at, nearest);
}

function handleHit(shape: SceneShape, at: (place: Place) => Point, nearest: Nearest): Hit | null {
  if ('corners' in shape) return ringHit(shape.id, shape.corners, true, at, nearest);
  if (nearest([shape.rim], at)) return { on: 'rim', id: shape.id };
  return nearest([shape.centre], at) ? { on: 'centre', id: shape.id } : null;
}

/** `edge` n: a corner inserted there would be number n. */
function ringHit(
  of: CornerOwner,
  ring: readonly Place[],
  isClosed: boolean,
  at: (place: Place) => Point,
  nearest: Nearest,
): Hit | null {
  const numbered = ring.map((place, number) => ({ place, number }));
  const corner = nearest(numbered, ({ place }) => at(place));
  if (corner) return { on: 'corner', of, at: corner.number };
  const edges = numbered.slice(0, isClosed ? undefined : -1).flatMap(({ place, number }) => {
    const [a, b] = [at(place), at(ring[(number + 1) % ring.length]!)];
    return isLong(a, b) ? [{ middle: middleOf(a, b), number: number + 1 }] : [];
  });
  const edge = nearest(edges, ({ middle }) => middle);
  return edge && { on: 'edge', of, at: edge.number };
}

function isOnOutline(shape: SceneShape, at: (place: Place) => Point, { x, y }: Point, reachPx: number): boolean {
  if (!('corners' in shape)) {
    const [centre, rim] = [at(shape.centre), at(shape.rim)];
    const radius = Math.hypot(rim.x - centre.x, rim.y - centre.y);
    const away = Math.hypot(x - centre.x, y - centre.y);
    return Math.abs(away - radius) <= reachPx || away <= reachPx;
  }
  return shape.corners.some((corner, number) => {
    const [a, b] = [at(corner), at(shape.corners[(number + 1) % shape.corners.length]!)];
    const [dx, dy] = [b.x - a.x, b.y - a.y];
    const length2 = dx * dx + dy * dy;
    const part = length2 === 0 ? 0 : Math.max(0, Math.min(1, ((x - a.x) * dx + (y - a.y) * dy) / length2));
    return Math.hypot(a.x + dx * part - x, a.y + dy * part - y) <= reachPx;
  });
}

/** All places to show when a plan opens. */
export const planPlaces = (plan: Plan): Place[] => [
  ...(plan.home ? [placeOf(plan.home.spot)] : []),
  ...plan.items
    .filter((item) => (specOf(item.command)?.place ?? 'none') !== 'none' && !isNoPlace(spotOfItem(item)))
    .map((item) => placeOf(spotOfItem(item))),
  ...plan.fence.shapes.flatMap((shape) =>
    shape.shape === 'polygon'
      ? shape.corners.map(placeOf)
      : [0, 90, 180, 270].map((bearing) => placeOf(spotAt(shape.centre, shape.radiusM, bearing))),
  ),
  ...plan.rally.map(({ spot }) => placeOf(spot)),
];
