/** The plans on board as a scene for the drone's page. Pure: the canvas is onboard_layer.ts. */

import { t } from '../languages/text';
import type { OnboardRows } from '../link/onboard_plans';
import type { Place } from '../link/messages';
import { PLAN_KINDS } from '../link/operation_types';
import { NOTHING_DRAWN } from '../plan/drawing';
import { flownPath, type FlownPath } from '../plan/flown_path';
import { EMPTY_PLAN, spotOf, type Plan } from '../plan/plan_types';
import { itemOfRow, withItems } from '../plan/wire_items';
import { planScene, type PlanScene } from './plan_scene';

/** The drone's home and its height above sea level. */
export interface OnboardHome {
  readonly place: Place;
  readonly altM: number;
}

export interface OnboardState {
  readonly rows: OnboardRows;
  readonly home: OnboardHome | null;
  /** Items from 0. */
  readonly current: number | null;
  readonly reached: ReadonlySet<number>;
}

export interface Laid {
  readonly plan: Plan;
  readonly path: FlownPath;
}

/** Raises RangeError for invalid items. */
export function laidOut(rows: OnboardRows, home: OnboardHome | null): Laid {
  const { latDeg, lonDeg } = home?.place ?? { latDeg: 0, lonDeg: 0 };
  let plan: Plan = { ...EMPTY_PLAN, home: home && { spot: spotOf(latDeg, lonDeg), altM: home.altM } };
  for (const kind of PLAN_KINDS) {
    const items = (rows[kind] ?? []).map((row, at) =>
      itemOfRow(row, t('Item {at} of the {kind}', { at: at + 1, kind })),
    );
    plan = withItems(plan, kind, items).plan;
  }
  return { plan, path: flownPath(plan) };
}

/** The path begins at home, whose symbol the drones' layer draws. */
export function onboardScene({ plan, path }: Laid, current: number | null, reached: ReadonlySet<number>): PlanScene {
  const scene = planScene({
    plan,
    path,
    drawing: NOTHING_DRAWN,
    preview: [],
    faults: new Set(),
    forbidden: new Set(),
    current,
    reached,
  });
  return { ...scene, home: null, showsHandles: false };
}

export function isSameHome(one: OnboardHome | null, other: OnboardHome | null): boolean {
  if (!one || !other) return one === other;
  const [a, b] = [one.place, other.place];
  return a.latDeg === b.latDeg && a.lonDeg === b.lonDeg && one.altM === other.altM;
}
