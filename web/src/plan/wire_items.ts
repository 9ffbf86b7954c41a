/** Converts between the planner's values and the items of a transfer: one list for each kind of plan, without home. */

import { t } from '../languages/text';
import { CMD } from './catalogue';
import type { Fence, FenceShape, Param, Plan, PlanItem, PlanKind, RallyPoint, Spot, WireItem } from './plan_types';

/** As in a file or a REST body: fields in wire order. */
export type ItemRow = readonly [number, number, readonly [Param, Param, Param, Param], number, number, number, number];

export const rowOf = (item: WireItem): ItemRow => [
  item.command,
  item.frame,
  item.params,
  item.x,
  item.y,
  item.z,
  item.autocontinue,
];

const isInteger = (value: unknown, least: number, most: number): value is number =>
  Number.isInteger(value) && (value as number) >= least && (value as number) <= most;

const MAX_FLOAT32 = 3.4028234663852886e38;
const isFloat32 = (value: unknown): value is number =>
  typeof value === 'number' && Math.abs(value) <= MAX_FLOAT32 && !Number.isNaN(value);

/** Throws a RangeError that describes the fault, for `who` ("Item 3"). */
export function itemOfRow(row: unknown, who: string): WireItem {
  if (!Array.isArray(row) || row.length !== 7) throw new RangeError(t('{who} is not a list of seven fields.', { who }));
  const [command, frame, params, x, y, z, autocontinue] = row as unknown[];
  if (!isInteger(command, 0, 0xffff))
    throw new RangeError(t('{who}: the command is not a number from 0 to 65535.', { who }));
  if (!isInteger(frame, 0, 0xff)) throw new RangeError(t('{who}: the frame is not a number from 0 to 255.', { who }));
  if (!Array.isArray(params) || params.length !== 4 || !params.every((one) => one === null || isFloat32(one))) {
    throw new RangeError(t('{who}: the parameters are not four numbers.', { who }));
  }
  for (const axis of [x, y]) {
    if (!isInteger(axis, -0x8000_0000, 0x7fff_ffff)) {
      throw new RangeError(t('{who}: the place is not in whole 1e-7 degrees.', { who }));
    }
  }
  if (!isFloat32(z)) throw new RangeError(t('{who}: the height is not a number.', { who }));
  if (!isInteger(autocontinue, 0, 0xff)) throw new RangeError(t('{who}: autocontinue is not 0 or 1.', { who }));
  const [p1, p2, p3, p4] = params as Param[];
  return wireItem(
    command,
    frame,
    [p1 ?? null, p2 ?? null, p3 ?? null, p4 ?? null],
    x as number,
    y as number,
    z,
    autocontinue,
  );
}

/** JSON has no reliable negative zero: adding zero makes it positive, as everywhere else. */
export const float32 = (value: number): number => Math.fround(value) + 0;

const rounded = (value: Param): Param => (value === null || Number.isNaN(value) ? null : float32(value));

/** Rounds to the wire's resolution, so that comparisons with a downloaded plan are exact. */
export function wireItem(
  command: number,
  frame: number,
  params: readonly [Param, Param, Param, Param],
  x: number,
  y: number,
  z: number,
  autocontinue = 1,
): WireItem {
  const [p1, p2, p3, p4] = params;
  return {
    command,
    frame,
    params: [rounded(p1), rounded(p2), rounded(p3), rounded(p4)],
    x,
    y,
    z: float32(z),
    autocontinue,
  };
}

/** The mission of a plan; jumps refer to the current index (from 0) of their target. */
export function missionItems(plan: Plan): WireItem[] {
  const seqOf = new Map(plan.items.map((item, seq) => [item.id, seq]));
  return plan.items.map(({ command, frame, params, x, y, z, autocontinue, jumpTo }) => {
    const seq = jumpTo === null ? undefined : seqOf.get(jumpTo);
    const [p1, p2, p3, p4] = params;
    return { command, frame, params: [seq ?? p1, p2, p3, p4], x, y, z, autocontinue };
  });
}

/** Assigns ids from `nextId` on, and links jumps to their targets. */
export function planItems(items: readonly WireItem[], nextId: number): PlanItem[] {
  return items.map((item, seq) => {
    const target = item.command === CMD.JUMP ? item.params[0] : null;
    const isHere = target !== null && Number.isInteger(target) && target >= 0 && target < items.length;
    return { ...item, id: nextId + seq, jumpTo: isHere ? nextId + target : null };
  });
}

const at = (command: number, frame: number, spot: Spot, p1: number, p2: number, z = 0): WireItem =>
  wireItem(command, frame, [p1, p2, 0, 0], spot.latE7, spot.lonE7, z);

export function fenceItems(fence: Fence): WireItem[] {
  const items: WireItem[] = [];
  if (fence.returnPoint) {
    const { frame, spot, heightM } = fence.returnPoint;
    items.push(at(CMD.FENCE_RETURN, frame, spot, 0, 0, heightM));
  }
  for (const one of fence.shapes) {
    if (one.shape === 'polygon') {
      const command = one.inclusion ? CMD.FENCE_POLYGON_IN : CMD.FENCE_POLYGON_OUT;
      for (const corner of one.corners) items.push(at(command, one.frame, corner, one.corners.length, one.group));
    } else {
      const command = one.inclusion ? CMD.FENCE_CIRCLE_IN : CMD.FENCE_CIRCLE_OUT;
      items.push(at(command, one.frame, one.centre, one.radiusM, one.group));
    }
  }
  return items;
}

export interface ReadFence {
  readonly fence: Fence;
  readonly nextId: number;
  /** What could not be read, in words. */
  readonly dropped: readonly string[];
}

/** Consecutive corners make a polygon: the number is in each of them. */
export function fenceOfItems(items: readonly WireItem[], nextId: number): ReadFence {
  const shapes: FenceShape[] = [];
  const dropped: string[] = [];
  let returnPoint: Fence['returnPoint'] = null;
  let id = nextId;
  for (let seq = 0; seq < items.length;) {
    const item = items[seq]!;
    const spot = { latE7: item.x, lonE7: item.y };
    const { command, frame } = item;
    const size = item.params[0] ?? 0;
    const group = item.params[1] ?? 0;
    if (command === CMD.FENCE_RETURN) {
      if (returnPoint) dropped.push(t('Fence item {seq}: a second return point; the first is kept.', { seq: seq + 1 }));
      else returnPoint = { frame, spot, heightM: item.z };
      seq += 1;
    } else if (command === CMD.FENCE_CIRCLE_IN || command === CMD.FENCE_CIRCLE_OUT) {
      const inclusion = command === CMD.FENCE_CIRCLE_IN;
      shapes.push({ shape: 'circle', id: id++, inclusion, group, frame, centre: spot, radiusM: size });
      seq += 1;
    } else if (command === CMD.FENCE_POLYGON_IN || command === CMD.FENCE_POLYGON_OUT) {
      const corners = items.slice(seq, seq + Math.max(1, Math.trunc(size)));
      if (corners.length < 3 || !corners.every((one) => one.command === command && one.params[0] === size)) {
        dropped.push(t('Fence item {seq}: a corner of a polygon that is not whole.', { seq: seq + 1 }));
        seq += 1;
        continue;
      }
      const inclusion = command === CMD.FENCE_POLYGON_IN;
      const spots = corners.map(({ x, y }) => ({ latE7: x, lonE7: y }));
      shapes.push({ shape: 'polygon', id: id++, inclusion, group, frame, corners: spots });
      seq += corners.length;
    } else {
      dropped.push(t('Fence item {seq}: command {command} is none of a fence.', { seq: seq + 1, command }));
      seq += 1;
    }
  }
  return { fence: { shapes, returnPoint }, nextId: id, dropped };
}

export const rallyItems = (rally: readonly RallyPoint[]): WireItem[] =>
  rally.map(({ frame, spot, heightM }) => at(CMD.RALLY, frame, spot, 0, 0, heightM));

export interface ReadRally {
  readonly rally: readonly RallyPoint[];
  readonly nextId: number;
  readonly dropped: readonly string[];
}

export function rallyOfItems(items: readonly WireItem[], nextId: number): ReadRally {
  const rally: RallyPoint[] = [];
  const dropped: string[] = [];
  for (const [seq, item] of items.entries()) {
    if (item.command !== CMD.RALLY) {
      dropped.push(
        t('Rally item {seq}: command {command} is no rally point.', { seq: seq + 1, command: item.command }),
      );
      continue;
    }
    rally.push({
      id: nextId + rally.length,
      frame: item.frame,
      spot: { latE7: item.x, lonE7: item.y },
      heightM: item.z,
    });
  }
  return { rally, nextId: nextId + rally.length, dropped };
}

/** The items that an upload of the plan would send. */
export function itemsOf(plan: Plan, kind: PlanKind): WireItem[] {
  switch (kind) {
    case 'mission':
      return missionItems(plan);
    case 'fence':
      return fenceItems(plan.fence);
    case 'rally':
      return rallyItems(plan.rally);
  }
}

export interface ReadPart {
  readonly plan: Plan;
  readonly dropped: readonly string[];
}

/** The plan with one kind replaced by items from a drone or a file. */
export function withItems(plan: Plan, kind: PlanKind, items: readonly WireItem[]): ReadPart {
  if (kind === 'mission') {
    const read = planItems(items, plan.nextId);
    return { plan: { ...plan, items: read, nextId: plan.nextId + read.length }, dropped: [] };
  }
  if (kind === 'fence') {
    const { fence, nextId, dropped } = fenceOfItems(items, plan.nextId);
    return { plan: { ...plan, fence, nextId }, dropped };
  }
  const { rally, nextId, dropped } = rallyOfItems(items, plan.nextId);
  return { plan: { ...plan, rally, nextId }, dropped };
}
