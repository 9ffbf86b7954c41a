/**
 * A plan as the tower's library stores it: the wire's items of each kind, the planned home, the defaults. Invalid
 * content raises a RangeError with a message for people.
 */

import { t } from '../languages/text';
import { datumOf } from './frames';
import { EMPTY_PLAN, isOnEarth, MAX_ITEMS, type Plan, type PlanDefaults, type PlanKind } from './plan_types';
import { itemOfRow, itemsOf, rowOf, withItems, type ItemRow, type ReadPart } from './wire_items';

export interface PlanDocument {
  readonly mission: readonly ItemRow[];
  readonly fence: readonly ItemRow[];
  readonly rally: readonly ItemRow[];
  readonly home?: { readonly lat_e7: number; readonly lon_e7: number; readonly alt_m: number };
  readonly defaults: { readonly height_m: number; readonly frame: number; readonly speed_m_s: number };
}

const KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];

export function documentOf(plan: Plan): PlanDocument {
  const { home, defaults } = plan;
  return {
    mission: itemsOf(plan, 'mission').map(rowOf),
    fence: itemsOf(plan, 'fence').map(rowOf),
    rally: itemsOf(plan, 'rally').map(rowOf),
    ...(home && { home: { lat_e7: home.spot.latE7, lon_e7: home.spot.lonE7, alt_m: home.altM } }),
    defaults: { height_m: defaults.heightM, frame: defaults.frame, speed_m_s: defaults.speedMS },
  };
}

const isObject = (value: unknown): value is Record<string, unknown> =>
  typeof value === 'object' && value !== null && !Array.isArray(value);

const isFinite = (value: unknown): value is number => Number.isFinite(value);

function defaultsOf(value: unknown): PlanDefaults {
  if (value === undefined) return EMPTY_PLAN.defaults;
  if (!isObject(value)) throw new RangeError(t('The defaults of this plan are not a list of names and numbers.'));
  const { height_m: heightM, frame, speed_m_s: speedMS } = value;
  if (!isFinite(heightM) || !isFinite(speedMS) || !isFinite(frame) || datumOf(frame) === null) {
    throw new RangeError(t('The defaults of this plan are not a height, a frame of places on earth and a speed.'));
  }
  return { heightM, frame, speedMS };
}

function homeOf(value: unknown): Plan['home'] {
  if (value === undefined || value === null) return null;
  if (isObject(value)) {
    const { lat_e7: latE7, lon_e7: lonE7, alt_m: altM } = value;
    if (isFinite(latE7) && isFinite(lonE7) && isFinite(altM) && isOnEarth({ latE7, lonE7 })) {
      return { spot: { latE7, lonE7 }, altM };
    }
  }
  throw new RangeError(t('The home of this plan is not a place on earth with a height.'));
}

export function planOfDocument(document: unknown): ReadPart {
  if (!isObject(document)) throw new RangeError(t('This is not a plan: it has no mission, fence and rally points.'));
  let plan: Plan = { ...EMPTY_PLAN, home: homeOf(document['home']), defaults: defaultsOf(document['defaults']) };
  const dropped: string[] = [];
  for (const kind of KINDS) {
    const rows = document[kind];
    if (!Array.isArray(rows)) throw new RangeError(t('This is not a plan: its {kind} is not a list.', { kind }));
    if (rows.length > MAX_ITEMS) {
      throw new RangeError(
        t('The {kind} of this plan has {rows} items; {maxItems} are the most.', {
          kind,
          rows: rows.length,
          maxItems: MAX_ITEMS,
        }),
      );
    }
    const read = withItems(
      plan,
      kind,
      rows.map((row, seq) => itemOfRow(row, t('Item {seq} of the {kind}', { seq: seq + 1, kind }))),
    );
    plan = read.plan;
    dropped.push(...read.dropped);
  }
  return { plan, dropped };
}
