/** The path that a mission flies, in order, including jumps: the basis of estimates and checks. */

import { CMD, specOf } from './catalogue';
import { isNoPlace } from './field_checks';
import { datumOf } from './frames';
import { distanceM } from './ground';
import type { Plan, PlanItem, Spot } from './plan_types';

/**
 * How it ends: `ends` at its last item or a return, `waits` for a command, `for-ever` in a jump loop, `too-long` to
 * follow.
 */
export type Ending = 'ends' | 'waits' | 'for-ever' | 'too-long';

/** Longer than any battery lasts. */
export const MAX_STEPS_FLOWN = 20_000;

export interface Order {
  /** Indices in the plan's list, in the order of flight. */
  readonly steps: readonly number[];
  readonly ending: Ending;
  /** The item where it ends, waits or loops for ever. */
  readonly last: number | null;
}

export function flownOrder(plan: Plan): Order {
  const seqOf = new Map(plan.items.map((item, seq) => [item.id, seq]));
  const jumped = new Map<number, number>();
  const steps: number[] = [];
  let seq = 0;
  let jumpsInARow = 0;
  while (seq < plan.items.length) {
    if (steps.length >= MAX_STEPS_FLOWN || jumpsInARow > plan.items.length) {
      return { steps, ending: 'too-long', last: seq };
    }
    const item = plan.items[seq]!;
    if (item.command === CMD.JUMP) {
      const target = item.jumpTo === null ? undefined : seqOf.get(item.jumpTo);
      const times = item.params[1] ?? 0;
      const done = jumped.get(seq) ?? 0;
      if (target !== undefined && times < 0) return { steps, ending: 'for-ever', last: seq };
      if (target !== undefined && done < times) {
        jumped.set(seq, done + 1);
        jumpsInARow += 1;
        seq = target;
        continue;
      }
    } else {
      jumpsInARow = 0;
      steps.push(seq);
      if (item.command === CMD.RETURN) return { steps, ending: 'ends', last: seq };
      if (item.command === CMD.LOITER_UNLIMITED) return { steps, ending: 'waits', last: seq };
    }
    seq += 1;
  }
  return { steps, ending: 'ends', last: steps.at(-1) ?? null };
}

export interface Leg {
  /** The item that it flies to or carries out. */
  readonly seq: number;
  readonly from: Spot;
  readonly to: Spot;
  readonly lengthM: number;
  /** Above home. Where the ground is not known it is taken to be as high as home. */
  readonly fromHeightM: number;
  readonly toHeightM: number;
  /** Both ends are in the terrain frame: the autopilot follows the ground between them. */
  readonly followsGround: boolean;
}

/** Metres above the sea; null: not known; undefined: being loaded. */
export type GroundAt = (spot: Spot) => number | null | undefined;
const NO_GROUND: GroundAt = () => null;

/** Metres above the planned home; null if unknown: a height above sea level without a home. */
export function heightAboveHomeM(plan: Plan, item: PlanItem, ground: GroundAt = NO_GROUND): number | null {
  if (datumOf(item.frame) === 'terrain') {
    const under = ground({ latE7: item.x, lonE7: item.y });
    const atHome = plan.home && ground(plan.home.spot);
    return typeof under === 'number' && typeof atHome === 'number' ? item.z + under - atHome : item.z;
  }
  if (datumOf(item.frame) !== 'sea') return item.z;
  return plan.home ? item.z - plan.home.altM : null;
}

export interface FlownPath {
  readonly legs: readonly Leg[];
  readonly order: Order;
}

const isLanding = (command: number): boolean => command === CMD.LAND || command === CMD.VTOL_LAND;

/** Begins at the planned home, if any, on the ground; otherwise at the first place. */
export function flownPath(plan: Plan, ground: GroundAt = NO_GROUND): FlownPath {
  const order = flownOrder(plan);
  const legs: Leg[] = [];
  let here: Spot | null = plan.home?.spot ?? null;
  let heightM = 0;
  let wasOverGround = false;
  const fly = (seq: number, to: Spot, toHeightM: number, isOverGround = false): void => {
    const from = here ?? to;
    const followsGround = wasOverGround && isOverGround;
    legs.push({ seq, from, to, lengthM: distanceM(from, to), fromHeightM: heightM, toHeightM, followsGround });
    here = to;
    heightM = toHeightM;
    wasOverGround = isOverGround;
  };
  for (const seq of order.steps) {
    const item = plan.items[seq]!;
    if (item.command === CMD.RETURN && plan.home) {
      fly(seq, plan.home.spot, heightM);
      fly(seq, plan.home.spot, 0);
      continue;
    }
    if (!specOf(item.command)?.flies) continue;
    const own = { latE7: item.x, lonE7: item.y };
    const to: Spot | null = isNoPlace(own) ? here : own;
    if (!to) continue;
    const target = heightAboveHomeM(plan, item, ground) ?? heightM;
    if (isLanding(item.command)) {
      fly(seq, to, heightM);
      fly(seq, to, Math.min(target, heightM));
    } else if (item.command === CMD.TAKEOFF || item.command === CMD.VTOL_TAKEOFF) {
      // It climbs in place; only planes fly to the place of a take-off.
      fly(seq, here ?? to, target);
    } else {
      fly(seq, to, target, datumOf(item.frame) === 'terrain');
    }
  }
  return { legs, order };
}
