/**
 * Drawing a plan on a map, as a state machine without a map: presses, drags, clicks and keys go in, the next state and
 * the edits of the plan come out. Screen positions are the map's concern; it passes what was hit.
 */

import { plural, t } from '../languages/text';
import { CMD, specOf } from './catalogue';
import {
  addRally,
  addShape,
  changeRally,
  insertCorner,
  insertItems,
  newItem,
  NOWHERE,
  placeCircle,
  placeCorner,
  placeItem,
  removeCorner,
  removeItems,
  removeRally,
  removeShape,
  setHome,
  setRadius,
  setReturnPoint,
  shiftParts,
  together,
  type Edit,
} from './edits';
import { FRAME } from './frames';
import { distanceM } from './ground';
import { cleanLine, cleanOutline } from './outline';
import type { PartId, Plan, Spot, WireItem } from './plan_types';

export type Tool =
  'select' | 'item' | 'home' | 'survey' | 'corridor' | 'orbit' | 'fence-polygon' | 'fence-circle' | 'rally';

/** A fence shape by its id, or the current drawing. */
export type CornerOwner = PartId | 'draft';

export type Hit =
  | { readonly on: 'item' | 'shape' | 'centre' | 'rim' | 'rally'; readonly id: PartId }
  | { readonly on: 'home' | 'return' | 'draft-centre' | 'draft-rim' }
  /** The middle of the leg to item number `at`. */
  | { readonly on: 'leg'; readonly at: number }
  | { readonly on: 'corner' | 'edge'; readonly of: CornerOwner; readonly at: number };

export interface Drawing {
  readonly tool: Tool;
  /** The command that tool `item` places. */
  readonly command: number;
  /** Items, fence shapes and rally points: their ids are distinct. */
  readonly selected: ReadonlySet<PartId>;
  readonly corner: { readonly of: CornerOwner; readonly at: number } | null;
  /** The outline, line or centre being drawn. */
  readonly draft: readonly Spot[];
  /** The outline is complete: further input changes it. */
  readonly isWhole: boolean;
  /** For a circle being drawn. */
  readonly radiusM: number;
  readonly drag: {
    readonly hit: Hit;
    readonly last: Spot;
    readonly gesture: string;
    readonly hasMoved: boolean;
  } | null;
  readonly gestures: number;
}

export const NOTHING_DRAWN: Drawing = {
  tool: 'select',
  command: CMD.WAYPOINT,
  selected: new Set(),
  corner: null,
  draft: [],
  isWhole: false,
  radiusM: 50,
  drag: null,
  gestures: 0,
};

export interface Step {
  readonly drawing: Drawing;
  readonly edits: readonly Edit[];
}

const NEW_CIRCLE_M = 100;
const MIN_RADIUS_M = 1;
const WANTED_CORNERS: Partial<Record<Tool, number>> = { survey: 3, 'fence-polygon': 3, corridor: 2 };

const still = (drawing: Drawing): Step => ({ drawing, edits: [] });
const withEdits = (drawing: Drawing, ...edits: readonly Edit[]): Step => ({ drawing, edits });
const only = (id: PartId): ReadonlySet<PartId> => new Set([id]);

export const chooseTool = (drawing: Drawing, tool: Tool, command: number = CMD.WAYPOINT): Drawing => ({
  ...drawing,
  tool,
  command,
  corner: null,
  draft: [],
  isWhole: false,
  drag: null,
});

export const select = (drawing: Drawing, ids: Iterable<PartId>): Drawing => ({
  ...drawing,
  selected: new Set(ids),
  corner: null,
});

/** Removes from the selection what is no longer in the plan. */
export function pruned(drawing: Drawing, plan: Plan): Drawing {
  const here = new Set([...plan.items, ...plan.fence.shapes, ...plan.rally].map(({ id }) => id));
  const selected = [...drawing.selected].filter((id) => here.has(id));
  const corner =
    drawing.corner && (drawing.corner.of === 'draft' || here.has(drawing.corner.of)) ? drawing.corner : null;
  if (selected.length === drawing.selected.size && corner === drawing.corner) return drawing;
  return { ...drawing, selected: new Set(selected), corner };
}

/** Whether the drawing has enough corners for this tool, each counted once. */
export function hasEnough({ tool, draft }: Drawing): boolean {
  const { corners } = tool === 'survey' || tool === 'fence-polygon' ? cleanOutline(draft) : cleanLine(draft);
  return corners.length >= (WANTED_CORNERS[tool] ?? 1);
}

// --- position of a new item ---

const isEnd = (item: WireItem): boolean =>
  item.command === CMD.RETURN || item.command === CMD.LAND || item.command === CMD.VTOL_LAND;
const isTakeOff = (item: WireItem): boolean => item.command === CMD.TAKEOFF || item.command === CMD.VTOL_TAKEOFF;

/**
 * After the last selected item; otherwise at the end, before the item that ends the mission: nothing after it is flown.
 */
export function placeForNew(plan: Plan, selected: ReadonlySet<PartId>): number {
  const last = plan.items.findLastIndex((item) => selected.has(item.id));
  const end = plan.items.at(-1);
  const isEndSelected = last === plan.items.length - 1 && end !== undefined && isEnd(end);
  if (last >= 0 && !isEndSelected) return last + 1;
  return end && isEnd(end) ? plan.items.length - 1 : plan.items.length;
}

/** A new item at its neighbour's height; preceded by a take-off in a mission that has none. */
export function seedsFor(plan: Plan, at: number, command: number, spot: Spot | null): WireItem[] {
  const fresh = newItem(plan.defaults, command, spot);
  const goes = (item: WireItem): boolean => specOf(item.command)?.flies === true && !isTakeOff(item) && !isEnd(item);
  const neighbour = plan.items.slice(0, at).findLast(goes) ?? plan.items.slice(at).find(goes);
  const isLike = neighbour && goes(fresh) && neighbour.frame !== FRAME.MISSION;
  const item = isLike ? { ...fresh, frame: neighbour.frame, z: neighbour.z } : fresh;
  const wantsTakeOff = plan.items.length === 0 && goes(fresh);
  return wantsTakeOff ? [newItem(plan.defaults, CMD.TAKEOFF, null), item] : [item];
}

/** Adds it at the position for new items, and selects it. */
export function addItem(drawing: Drawing, plan: Plan, command: number, spot: Spot | null): Step {
  const at = placeForNew(plan, drawing.selected);
  const seeds = seedsFor(plan, at, command, spot);
  const next = select(drawing, [plan.nextId + seeds.length - 1]);
  return withEdits(next, insertItems(at, seeds));
}

// --- the pointer ---

/** A press on something that can be dragged. `null`: the map keeps the press for itself. */
export function press(drawing: Drawing, plan: Plan, hit: Hit | null, spot: Spot): Step | null {
  if (!hit) return null;
  const isDrawing = drawing.tool !== 'select';
  const isOfDraft = hit.on === 'draft-centre' || hit.on === 'draft-rim' || ('of' in hit && hit.of === 'draft');
  // During drawing, items below do not block: a click on them is a corner.
  if (isDrawing && !isOfDraft && !(drawing.tool === 'item' && (hit.on === 'item' || hit.on === 'leg'))) return null;
  const gesture = t('drag {gestures}', { gestures: drawing.gestures });
  const begun = { ...drawing, gestures: drawing.gestures + 1, drag: { hit, last: spot, gesture, hasMoved: false } };
  if (hit.on === 'leg') {
    const seeds = seedsFor(plan, hit.at, CMD.WAYPOINT, spot);
    const drag = { ...begun.drag, hit: { on: 'item', id: plan.nextId } as const, hasMoved: true };
    return withEdits({ ...begun, drag, selected: only(plan.nextId) }, { ...insertItems(hit.at, seeds), gesture });
  }
  if (hit.on !== 'edge') return still(begun);
  const drag = { ...begun.drag, hit: { ...hit, on: 'corner' } as const, hasMoved: true };
  const corner = { of: hit.of, at: hit.at };
  if (hit.of === 'draft') return still({ ...begun, drag, corner, draft: drawing.draft.toSpliced(hit.at, 0, spot) });
  return withEdits({ ...begun, drag, corner }, { ...insertCorner(hit.of, hit.at, spot), gesture });
}

export function drag(drawing: Drawing, plan: Plan, spot: Spot): Step {
  const held = drawing.drag;
  if (!held) return still(drawing);
  const { hit, last, gesture } = held;
  const next = { ...drawing, drag: { ...held, last: spot, hasMoved: true } };
  switch (hit.on) {
    case 'item':
    case 'rally':
    case 'shape':
    case 'centre': {
      // Dragging one of several selected parts moves all of them.
      const isGroup = drawing.selected.has(hit.id) && drawing.selected.size > 1;
      if (isGroup || hit.on === 'shape') {
        const moved = isGroup ? drawing.selected : only(hit.id);
        return withEdits(next, shiftParts(moved, spot.latE7 - last.latE7, spot.lonE7 - last.lonE7, gesture));
      }
      if (hit.on === 'item') return withEdits(next, placeItem(hit.id, spot, gesture));
      if (hit.on === 'rally') return withEdits(next, changeRally(hit.id, { spot }, gesture));
      return withEdits(next, placeCircle(hit.id, spot, gesture));
    }
    case 'rim': {
      const circle = plan.fence.shapes.find(({ id }) => id === hit.id);
      if (circle?.shape !== 'circle') return still(next);
      return withEdits(next, setRadius(hit.id, radiusTo(circle.centre, spot), gesture));
    }
    case 'home':
      return withEdits(next, setHome({ altM: 0, ...plan.home, spot }, gesture));
    case 'return': {
      const before = plan.fence.returnPoint;
      return before ? withEdits(next, { ...setReturnPoint({ ...before, spot }), gesture }) : still(next);
    }
    case 'corner':
      if (hit.of === 'draft') return still({ ...next, draft: drawing.draft.with(hit.at, spot) });
      return withEdits(next, placeCorner(hit.of, hit.at, spot, gesture));
    case 'draft-centre':
      return still({ ...next, draft: [spot] });
    case 'draft-rim':
      return still({ ...next, radiusM: radiusTo(drawing.draft[0] ?? spot, spot) });
    default:
      return still(next);
  }
}

const radiusTo = (centre: Spot, spot: Spot): number => Math.max(MIN_RADIUS_M, Math.round(distanceM(centre, spot)));

/** Pointer up. `extend`: add to the selection, or remove from it. */
export function release(drawing: Drawing, extend: boolean): Step {
  const held = drawing.drag;
  if (!held) return still(drawing);
  const next = { ...drawing, drag: null };
  return still(held.hasMoved ? next : chosen(next, held.hit, extend));
}

function chosen(drawing: Drawing, hit: Hit, extend: boolean): Drawing {
  if (hit.on === 'corner') {
    const isFirst = hit.of === 'draft' && hit.at === 0 && !drawing.isWhole;
    if (isFirst && drawing.tool !== 'corridor' && hasEnough(drawing)) return { ...drawing, isWhole: true };
    const selected = hit.of === 'draft' ? drawing.selected : only(hit.of);
    return { ...drawing, corner: { of: hit.of, at: hit.at }, selected };
  }
  if (!('id' in hit)) return drawing;
  if (!extend) return select(drawing, [hit.id]);
  const selected = new Set(drawing.selected);
  if (!selected.delete(hit.id)) selected.add(hit.id);
  return { ...drawing, selected, corner: null };
}

/** A click on an empty place. */
export function click(drawing: Drawing, plan: Plan, spot: Spot): Step {
  switch (drawing.tool) {
    case 'select':
      return still(select(drawing, []));
    case 'item':
      return addItem(drawing, plan, drawing.command, spot);
    case 'home':
      return withEdits(chooseTool(drawing, 'select'), setHome({ altM: 0, ...plan.home, spot }));
    case 'rally': {
      const next = select(drawing, [plan.nextId]);
      const { heightM, frame } = plan.defaults;
      return withEdits(next, addRally({ frame, spot, heightM }));
    }
    case 'fence-circle': {
      const next = select(chooseTool(drawing, 'select'), [plan.nextId]);
      const shape = { inclusion: true, group: 0, frame: FRAME.GLOBAL, centre: spot, radiusM: NEW_CIRCLE_M };
      return withEdits(next, addShape({ shape: 'circle', ...shape }));
    }
    case 'orbit':
      return still({ ...drawing, draft: [spot], isWhole: true });
    case 'survey':
    case 'corridor':
    case 'fence-polygon':
      if (drawing.isWhole) return still({ ...drawing, corner: null });
      return still({ ...drawing, draft: [...drawing.draft, spot], corner: null });
  }
}

/** Completes the drawing: by a double click, Enter, or a press on its first corner. */
export function finish(drawing: Drawing): Drawing {
  const isDrawn = drawing.draft.length > 0 && !drawing.isWhole && hasEnough(drawing);
  return isDrawn ? { ...drawing, isWhole: true, corner: null } : drawing;
}

/** Turns a complete fence polygon from a draft into a shape. */
export function settled(drawing: Drawing, plan: Plan): Step {
  if (drawing.tool !== 'fence-polygon' || !drawing.isWhole) return still(drawing);
  const shape = { inclusion: true, group: 0, frame: FRAME.GLOBAL, corners: cleanOutline(drawing.draft).corners };
  const next = select(chooseTool(drawing, 'select'), [plan.nextId]);
  return withEdits(next, addShape({ shape: 'polygon', ...shape }));
}

// --- keys ---

/** Escape: one step back at a time. */
export function back(drawing: Drawing): Drawing {
  if (drawing.drag) return { ...drawing, drag: null };
  if (drawing.draft.length > 0) return { ...drawing, draft: [], isWhole: false, corner: null };
  if (drawing.tool !== 'select') return chooseTool(drawing, 'select');
  return select(drawing, []);
}

/** Delete: the selected corner, otherwise the selection. */
export function remove(drawing: Drawing, plan: Plan): Step {
  const { corner, draft } = drawing;
  if (corner?.of === 'draft') {
    const left = draft.toSpliced(corner.at, 1);
    const next = { ...drawing, draft: left, corner: null };
    return still({ ...next, isWhole: drawing.isWhole && hasEnough(next) });
  }
  if (corner) return withEdits({ ...drawing, corner: null }, removeCorner(corner.of, corner.at));
  if (draft.length > 0 && !drawing.isWhole) return still({ ...drawing, draft: draft.slice(0, -1) });
  const ids = drawing.selected;
  if (ids.size === 0) return still(drawing);
  const isGone = ({ id }: { readonly id: PartId }): boolean => ids.has(id);
  const edits = [
    removeItems(ids),
    ...plan.fence.shapes.filter(isGone).map(({ id }) => removeShape(id)),
    ...plan.rally.filter(isGone).map(({ id }) => removeRally(id)),
  ];
  const items = plan.items.filter(isGone).length;
  const words = plural(ids.size, { one: 'Remove one part', other: 'Remove {n} parts' });
  const last = plan.items.findLastIndex(isGone);
  const heir = plan.items.slice(last + 1)[0] ?? plan.items.findLast((item) => !ids.has(item.id));
  const next = select(drawing, items > 0 && items === ids.size && heir ? [heir.id] : []);
  return withEdits(next, together(words, edits));
}

/** Moves the selection by this many metres: for arrow keys. */
export function nudge(drawing: Drawing, northM: number, eastM: number, plan: Plan): Step {
  const first = plan.items.find(({ id }) => drawing.selected.has(id));
  const latE7 = first ? first.x : (plan.home?.spot.latE7 ?? 0);
  const perMetre = 1e7 / 111_195;
  const lat = Math.round(northM * perMetre);
  const lon = Math.round((eastM * perMetre) / Math.max(0.05, Math.cos((latE7 / 1e7) * (Math.PI / 180))));
  return withEdits(drawing, shiftParts(drawing.selected, lat, lon, `nudge ${[...drawing.selected].join(' ')}`));
}

/** A jump whose target is no longer in the plan. */
export const isLost = (item: WireItem): boolean => item.command === CMD.JUMP && item.params[0] === NOWHERE;
