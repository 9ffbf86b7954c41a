/**
 * Maps the index of an uploaded item to the part of the plan that it belongs to: the corners of a fence are items too.
 */

import type { PartId, Plan, PlanKind } from './plan_types';

/** `at`: from 0 among the uploaded items of that kind. Null: it belongs to no part, as the return point of a fence. */
export function partOfItem(plan: Plan, kind: PlanKind, at: number): PartId | null {
  if (kind === 'mission') return plan.items[at]?.id ?? null;
  if (kind === 'rally') return plan.rally[at]?.id ?? null;
  let left = at - (plan.fence.returnPoint ? 1 : 0);
  if (left < 0) return null;
  for (const shape of plan.fence.shapes) {
    left -= shape.shape === 'polygon' ? shape.corners.length : 1;
    if (left < 0) return shape.id;
  }
  return null;
}
