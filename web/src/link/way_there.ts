/** The straight way to a place: how far, how long, and what the battery has left at home after it. Pure. */

import { distanceM } from './geometry';
import type { Place } from './messages';
import { afterWayHome, MOVING_MPS, USUAL_MPS, type WayHomeFacts } from './way_home';

/** As a multicopter climbs and descends by itself. */
const UP_MPS = 2.5;
const DOWN_MPS = 1.5;

export interface WayThere {
  readonly distanceM: number;
  readonly timeS: number;
  /** Over the ground: the present one, or a usual one while it hovers. */
  readonly speedMps: number;
  /** Of the battery, after the way there and the way home from there; negative: not enough. Null: not known. */
  readonly leftMs: number | null;
}

/** `altRelM`: above home, at the place. Null without a position. */
export function wayThere(facts: WayHomeFacts, place: Place, altRelM: number): WayThere | null {
  if (!facts.place) return null;
  const awayM = distanceM(facts.place, place);
  const { groundSpeedMps } = facts;
  const speedMps = groundSpeedMps !== null && groundSpeedMps >= MOVING_MPS ? groundSpeedMps : USUAL_MPS;
  const climbM = facts.altRelM === null ? 0 : altRelM - facts.altRelM;
  const timeS = Math.max(awayM / speedMps, climbM > 0 ? climbM / UP_MPS : -climbM / DOWN_MPS);
  const { afterMs } = afterWayHome({
    ...facts,
    place,
    altRelM,
    homeDistanceM: facts.home && distanceM(place, facts.home),
  });
  return { distanceM: awayM, timeS, speedMps, leftMs: afterMs === null ? null : afterMs - timeS * 1000 };
}
