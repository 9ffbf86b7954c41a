/**
 * Waypoints at a constant height above the ground: each is set to the ground under it, and more are added where the
 * straight way between two would depart from that height by more than a tolerance.
 *
 * The result is in heights above home, not in the terrain frame of MAVLink: any autopilot flies it, with elevation of
 * its own or without, and what is drawn and checked here is what is flown.
 */

import { t } from '../../languages/text';
import { CMD } from '../catalogue';
import type { GroundAt } from '../flown_path';
import { FRAME } from '../frames';
import { distanceM } from '../ground';
import { between } from '../over_ground';
import type { Spot, WireItem } from '../plan_types';
import { wireItem } from '../wire_items';
import { SurveyFault } from './area';

export interface FollowSettings {
  /** Above the ground. */
  readonly heightM: number;
  readonly toleranceM: number;
  readonly home: Spot | null;
  readonly ground: GroundAt;
}

/** Between two looks at the ground. */
const LOOK_EVERY_M = 4;
/** No leg is cut into pieces shorter than this. */
const MIN_PIECE_M = 8;
export const MIN_TOLERANCE_M = 0.5;

const spotOfItem = ({ x, y }: WireItem): Spot => ({ latE7: x, lonE7: y });

/** Throws a SurveyFault where the ground is not known, and without a home. */
export function followGround(items: readonly WireItem[], settings: FollowSettings): WireItem[] {
  const { heightM, toleranceM, home, ground } = settings;
  if (!(toleranceM >= MIN_TOLERANCE_M))
    throw new SurveyFault(t('The tolerance is {minTolerance} m or more.', { minTolerance: MIN_TOLERANCE_M }));
  if (!home) throw new SurveyFault(t('Heights above the ground need a planned home: choose a drone, or place it.'));
  const known = (spot: Spot): number => {
    const found = ground(spot);
    if (found === undefined) throw new SurveyFault(t('The heights of the ground are being loaded.'));
    if (found === null) throw new SurveyFault(t('The height of the ground is not known everywhere here.'));
    return found;
  };
  const homeM = known(home);
  const wanted = (spot: Spot): number => heightM + known(spot) - homeM;

  /** The places between two points, in order, where a waypoint is needed. */
  function cuts(from: Spot, to: Spot): Spot[] {
    const lengthM = distanceM(from, to);
    const looks = Math.ceil(lengthM / LOOK_EVERY_M);
    const heights = Array.from({ length: looks + 1 }, (_, at) => wanted(between(from, to, at / Math.max(1, looks))));
    const places: number[] = [];
    const cut = (first: number, last: number): void => {
      let [worst, worstM] = [-1, toleranceM];
      for (let at = first + 1; at < last; at += 1) {
        const line = heights[first]! + ((heights[last]! - heights[first]!) * (at - first)) / (last - first);
        const gapM = Math.abs(heights[at]! - line);
        const isApart = Math.min(at - first, last - at) * LOOK_EVERY_M >= MIN_PIECE_M;
        if (gapM > worstM && isApart) [worst, worstM] = [at, gapM];
      }
      if (worst < 0) return;
      cut(first, worst);
      places.push(worst);
      cut(worst, last);
    };
    cut(0, looks);
    return places.map((at) => between(from, to, at / looks));
  }

  const way = (spot: Spot, params: WireItem['params']): WireItem =>
    wireItem(CMD.WAYPOINT, FRAME.GLOBAL_RELATIVE_ALT, params, spot.latE7, spot.lonE7, wanted(spot));
  const followed: WireItem[] = [];
  let before: Spot | null = null;
  for (const item of items) {
    if (item.command !== CMD.WAYPOINT) {
      followed.push(item);
      continue;
    }
    const spot = spotOfItem(item);
    if (before) followed.push(...cuts(before, spot).map((one) => way(one, [0, 0, 0, null])));
    followed.push(way(spot, item.params));
    before = spot;
  }
  return followed;
}
