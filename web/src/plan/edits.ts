/**
 * The edits of a plan, as commands: each derives a new plan and leaves the old one unchanged. An edit that refers to a
 * missing part changes nothing. Jumps follow their target item when it moves; if it is removed, they go to the item
 * after it.
 */

import { plural, t } from '../languages/text';
import { CMD, commandWords, specOf } from './catalogue';
import { datumOf, FRAME } from './frames';
import { inOrder } from './outline';
import type {
  FenceReturn,
  FenceShape,
  PartId,
  Plan,
  PlanDefaults,
  PlanItem,
  PlannedHome,
  Params,
  RallyPoint,
  Spot,
  WireItem,
} from './plan_types';
import { planItems, wireItem } from './wire_items';

export interface Edit {
  /** "Move item 3": the text for undo and redo. */
  readonly words: string;
  /** Edits of one gesture (a drag, a number being typed) are one undo step. */
  readonly gesture?: string;
  readonly apply: (plan: Plan) => Plan;
}

/** A jump without a target: the checks refuse to send it. */
export const NOWHERE = -1;

type Seed = WireItem & { readonly jumpTo?: PartId };
type WithoutId<T> = T extends unknown ? Omit<T, 'id'> : never;

const edit = (words: string, apply: (plan: Plan) => Plan, gesture?: string): Edit =>
  gesture === undefined ? { words, apply } : { words, apply, gesture };

/** A new item of this command with the plan's defaults; `spot` where the command has a place. */
export function newItem(defaults: PlanDefaults, command: number, spot: Spot | null): WireItem {
  const spec = specOf(command);
  const params: [number | null, number | null, number | null, number | null] = [0, 0, 0, 0];
  for (const one of spec?.params ?? []) params[one.at] = one.initial;
  if (command === CMD.CHANGE_SPEED) params[1] = defaults.speedMS;
  const hasPlace = spec === null || spec.place !== 'none';
  const frame = hasPlace ? defaults.frame : FRAME.MISSION;
  const lands = command === CMD.LAND || command === CMD.VTOL_LAND || command === CMD.ROI_LOCATION;
  const z = spec?.height && !lands ? defaults.heightM : (spec?.raw?.z ?? 0);
  const { latE7, lonE7 } = hasPlace && spot ? spot : { latE7: 0, lonE7: 0 };
  return wireItem(command, frame, params, spec?.raw?.x ?? latE7, lonE7, z);
}

export function insertItems(at: number, seeds: readonly Seed[]): Edit {
  const words = plural(
    seeds.length,
    { one: 'Add {command}', other: 'Add {n} items' },
    { command: commandWords(seeds[0]!.command) },
  );
  return edit(words, (plan) => {
    if (seeds.length === 0) return plan;
    const items = seeds.map(({ jumpTo, ...item }, index): PlanItem => ({
      ...item,
      id: plan.nextId + index,
      jumpTo: jumpTo ?? null,
    }));
    return { ...plan, items: plan.items.toSpliced(at, 0, ...items), nextId: plan.nextId + items.length };
  });
}

/** Items from elsewhere, with jumps relative to the first of them. */
export const appendItems = (wire: readonly WireItem[]): Edit =>
  edit(t('Add {wire} items', { wire: wire.length }), (plan) => ({
    ...plan,
    items: [...plan.items, ...planItems(wire, plan.nextId)],
    nextId: plan.nextId + wire.length,
  }));

/** The jump after its target is removed. */
function followed(item: PlanItem, items: readonly PlanItem[], gone: ReadonlySet<PartId>): PlanItem {
  if (item.jumpTo === null || !gone.has(item.jumpTo)) return item;
  const from = items.findIndex((one) => one.id === item.jumpTo);
  const heir = items.find((one, seq) => seq > from && !gone.has(one.id) && one.id !== item.id);
  if (heir) return { ...item, jumpTo: heir.id };
  return { ...item, jumpTo: null, params: [NOWHERE, item.params[1], item.params[2], item.params[3]] };
}

export function removeItems(ids: Iterable<PartId>): Edit {
  const gone = new Set(ids);
  return edit(plural(gone.size, { one: 'Remove an item', other: 'Remove {n} items' }), (plan) => {
    if (!plan.items.some((item) => gone.has(item.id))) return plan;
    const left = plan.items.filter((item) => !gone.has(item.id));
    return { ...plan, items: left.map((item) => followed(item, plan.items, gone)) };
  });
}

/** Moves these items, in their order, before another one, or to the end (`null`). */
export function moveItems(ids: Iterable<PartId>, before: PartId | null): Edit {
  const moved = new Set(ids);
  return edit(plural(moved.size, { one: 'Move an item in the list', other: 'Move {n} items in the list' }), (plan) => {
    if (before !== null && moved.has(before)) return plan;
    const rest = plan.items.filter((item) => !moved.has(item.id));
    const at = before === null ? rest.length : rest.findIndex((item) => item.id === before);
    if (at < 0) return plan;
    const items = rest.toSpliced(at, 0, ...plan.items.filter((item) => moved.has(item.id)));
    return items.every((item, seq) => item === plan.items[seq]) ? plan : { ...plan, items };
  });
}

function changedItem(words: string, id: PartId, change: (item: PlanItem) => PlanItem, gesture?: string): Edit {
  return edit(
    words,
    (plan) => {
      const at = plan.items.findIndex((item) => item.id === id);
      if (at < 0) return plan;
      const before = plan.items[at]!;
      const after = change(before);
      return after === before ? plan : { ...plan, items: plan.items.with(at, after) };
    },
    gesture,
  );
}

const rewired = (item: PlanItem, wire: WireItem): PlanItem => ({ ...wire, id: item.id, jumpTo: item.jumpTo });

/** Drags an item: one undo step per `gesture`. */
export const placeItem = (id: PartId, spot: Spot, gesture?: string): Edit =>
  changedItem(t('Move an item'), id, (item) => ({ ...item, x: spot.latE7, y: spot.lonE7 }), gesture);

export const setParam = (id: PartId, at: 0 | 1 | 2 | 3, value: number | null, gesture?: string): Edit =>
  changedItem(
    t('Change an item'),
    id,
    (item) => {
      const { command, frame, x, y, z, autocontinue } = item;
      const params = item.params.with(at, value) as unknown as Params;
      return rewired(item, wireItem(command, frame, params, x, y, z, autocontinue));
    },
    gesture,
  );

export const setHeight = (id: PartId, heightM: number, gesture?: string): Edit =>
  changedItem(
    t('Change a height'),
    id,
    (item) =>
      rewired(item, wireItem(item.command, item.frame, item.params, item.x, item.y, heightM, item.autocontinue)),
    gesture,
  );

export const setFrame = (id: PartId, frame: number): Edit =>
  changedItem(t('Change what a height is measured from'), id, (item) => ({ ...item, frame }));

/** Replaces the command, with the new one's own parameters, at the same place and height. */
export const setCommand = (id: PartId, command: number): Edit =>
  edit(t('Make it {command}', { command: commandWords(command) }), (plan) => {
    const at = plan.items.findIndex((item) => item.id === id);
    const before = plan.items[at];
    if (!before || before.command === command) return plan;
    const hadPlace = specOf(before.command)?.place !== 'none';
    const fresh = newItem(plan.defaults, command, hadPlace ? { latE7: before.x, lonE7: before.y } : null);
    const hasHeight = hadPlace && before.z !== 0 && specOf(command)?.height;
    const wire = hasHeight ? { ...fresh, frame: before.frame, z: before.z } : fresh;
    return { ...plan, items: plan.items.with(at, { ...wire, id, jumpTo: null }) };
  });

export const setJumpTarget = (id: PartId, target: PartId): Edit =>
  edit(t('Change where a jump goes'), (plan) => {
    const at = plan.items.findIndex((item) => item.id === id && item.command === CMD.JUMP);
    if (at < 0 || !plan.items.some((item) => item.id === target)) return plan;
    return { ...plan, items: plan.items.with(at, { ...plan.items[at]!, jumpTo: target }) };
  });

export const setHome = (home: PlannedHome | null, gesture?: string): Edit =>
  edit(t('Move the planned home'), (plan) => ({ ...plan, home }), gesture);

export const setDefaults = (defaults: PlanDefaults): Edit =>
  edit(t('Change what new items begin with'), (plan) => ({ ...plan, defaults }));

/**
 * Replaces the whole plan, as from a file, the library or the drone. Ids continue from the old plan's: none is reused.
 */
export const replacePlan = (words: string, other: Plan): Edit =>
  edit(words, (plan) => ({ ...other, nextId: Math.max(plan.nextId, other.nextId) }));

/** Several as one step. */
export const together = (words: string, edits: readonly Edit[], gesture?: string): Edit =>
  edit(words, (plan) => edits.reduce((before, one) => one.apply(before), plan), gesture);

/** Moves parts of any kind by this many 1e-7 degrees. Items without a place do not change. */
export function shiftParts(ids: ReadonlySet<PartId>, latE7: number, lonE7: number, gesture?: string): Edit {
  const moved = (spot: Spot): Spot => ({ latE7: spot.latE7 + latE7, lonE7: spot.lonE7 + lonE7 });
  const movedItem = (item: PlanItem): PlanItem => {
    const hasPlace =
      specOf(item.command)?.place !== 'none' && datumOf(item.frame) !== null && (item.x !== 0 || item.y !== 0);
    return ids.has(item.id) && hasPlace ? { ...item, x: item.x + latE7, y: item.y + lonE7 } : item;
  };
  const movedShape = (shape: FenceShape): FenceShape => {
    if (!ids.has(shape.id)) return shape;
    if (shape.shape === 'circle') return { ...shape, centre: moved(shape.centre) };
    return { ...shape, corners: shape.corners.map(moved) };
  };
  return edit(
    plural(ids.size, { one: 'Move one part', other: 'Move {n} parts' }),
    (plan) => {
      if (ids.size === 0 || (latE7 === 0 && lonE7 === 0)) return plan;
      const shapes = plan.fence.shapes.map(movedShape);
      const rally = plan.rally.map((point) => (ids.has(point.id) ? { ...point, spot: moved(point.spot) } : point));
      return { ...plan, items: plan.items.map(movedItem), fence: { ...plan.fence, shapes }, rally };
    },
    gesture,
  );
}

// --- fence ---

export const addShape = (shape: WithoutId<FenceShape>): Edit =>
  edit(shape.shape === 'circle' ? t('Add a circle to the fence') : t('Add a polygon to the fence'), (plan) => ({
    ...plan,
    fence: { ...plan.fence, shapes: [...plan.fence.shapes, { ...shape, id: plan.nextId } as FenceShape] },
    nextId: plan.nextId + 1,
  }));

function changedShape(words: string, id: PartId, change: (shape: FenceShape) => FenceShape, gesture?: string): Edit {
  return edit(
    words,
    (plan) => {
      const at = plan.fence.shapes.findIndex((shape) => shape.id === id);
      if (at < 0) return plan;
      const before = plan.fence.shapes[at]!;
      const after = change(before);
      if (after === before) return plan;
      return { ...plan, fence: { ...plan.fence, shapes: plan.fence.shapes.with(at, after) } };
    },
    gesture,
  );
}

export const setInclusion = (id: PartId, inclusion: boolean): Edit =>
  changedShape(t('Change a side of the fence'), id, (shape) => ({ ...shape, inclusion }));

export const placeCircle = (id: PartId, centre: Spot, gesture?: string): Edit =>
  changedShape(t('Move a circle'), id, (shape) => (shape.shape === 'circle' ? { ...shape, centre } : shape), gesture);

export const setRadius = (id: PartId, radiusM: number, gesture?: string): Edit =>
  changedShape(
    t('Change a radius'),
    id,
    (shape) => (shape.shape === 'circle' ? { ...shape, radiusM: Math.fround(radiusM) } : shape),
    gesture,
  );

export const placeCorner = (id: PartId, at: number, spot: Spot, gesture?: string): Edit =>
  changedShape(
    t('Move a corner'),
    id,
    (shape) =>
      shape.shape === 'polygon' && at >= 0 && at < shape.corners.length
        ? { ...shape, corners: shape.corners.with(at, spot) }
        : shape,
    gesture,
  );

export const insertCorner = (id: PartId, at: number, spot: Spot): Edit =>
  changedShape(t('Add a corner'), id, (shape) =>
    shape.shape === 'polygon' ? { ...shape, corners: shape.corners.toSpliced(at, 0, spot) } : shape,
  );

/** Puts the corners in an order in which the border does not cross itself. */
export const orderCorners = (id: PartId): Edit =>
  changedShape(t('Put the corners in order'), id, (shape) =>
    shape.shape === 'polygon' ? { ...shape, corners: inOrder(shape.corners) } : shape,
  );

/** Keeps at least three corners. */
export const removeCorner = (id: PartId, at: number): Edit =>
  changedShape(t('Remove a corner'), id, (shape) =>
    shape.shape === 'polygon' && shape.corners.length > 3 && at >= 0 && at < shape.corners.length
      ? { ...shape, corners: shape.corners.toSpliced(at, 1) }
      : shape,
  );

export const removeShape = (id: PartId): Edit =>
  edit(t('Remove a part of the fence'), (plan) => {
    const shapes = plan.fence.shapes.filter((shape) => shape.id !== id);
    return shapes.length === plan.fence.shapes.length ? plan : { ...plan, fence: { ...plan.fence, shapes } };
  });

export const setReturnPoint = (returnPoint: FenceReturn | null): Edit =>
  edit(t("Move the fence's return point"), (plan) => ({ ...plan, fence: { ...plan.fence, returnPoint } }));

// --- rally ---

export const addRally = (point: Omit<RallyPoint, 'id'>): Edit =>
  edit(t('Add a rally point'), (plan) => ({
    ...plan,
    rally: [...plan.rally, { ...point, id: plan.nextId, heightM: Math.fround(point.heightM) }],
    nextId: plan.nextId + 1,
  }));

export const changeRally = (id: PartId, change: Partial<Omit<RallyPoint, 'id'>>, gesture?: string): Edit =>
  edit(
    t('Change a rally point'),
    (plan) => {
      const at = plan.rally.findIndex((point) => point.id === id);
      if (at < 0) return plan;
      const point = { ...plan.rally[at]!, ...change };
      return { ...plan, rally: plan.rally.with(at, { ...point, heightM: Math.fround(point.heightM) }) };
    },
    gesture,
  );

export const removeRally = (id: PartId): Edit =>
  edit(t('Remove a rally point'), (plan) => {
    const rally = plan.rally.filter((point) => point.id !== id);
    return rally.length === plan.rally.length ? plan : { ...plan, rally };
  });
