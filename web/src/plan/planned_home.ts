/** When a plan takes the home of the drone that it is for, and what moves with it. Pure. */

import { CMD } from './catalogue';
import { setHome, together, type Edit } from './edits';
import { distanceM } from './ground';
import type { PlanItem, PlannedHome, Spot } from './plan_types';

/** Arming moves a home a little. */
const SAME_HOME_M = 1;

const isAt = (one: Spot, other: Spot): boolean => distanceM(one, other) < SAME_HOME_M;
const spotOfItem = ({ x, y }: PlanItem): Spot => ({ latE7: x, lonE7: y });
const isTakeOff = ({ command }: PlanItem): boolean => command === CMD.TAKEOFF || command === CMD.VTOL_TAKEOFF;

/**
 * Whether the plan begins at another drone: it has no home, or that of a drone chosen before. A home that somebody put
 * elsewhere stays.
 */
export function beginsElsewhere(planned: PlannedHome | null, own: Spot, others: readonly Spot[]): boolean {
  if (planned === null) return true;
  return !isAt(planned.spot, own) && others.some((other) => isAt(planned.spot, other));
}

/** Moves home, and a take-off that stands on it. */
export function beginAt(home: PlannedHome): Edit {
  const { words, apply } = setHome(home);
  const moveTakeOffs: Edit = {
    words,
    apply(plan) {
      const before = plan.home;
      const moved = (item: PlanItem): PlanItem =>
        before && isTakeOff(item) && isAt(spotOfItem(item), before.spot)
          ? { ...item, x: home.spot.latE7, y: home.spot.lonE7 }
          : item;
      return { ...plan, items: plan.items.map(moved) };
    },
  };
  return together(words, [moveTakeOffs, { words, apply }]);
}
