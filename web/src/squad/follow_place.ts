/**
 * A follower's place beside its leader: metres north, east and above, independent of the leader's heading. The tower
 * and the agent refuse the same values (wire/following.py).
 */

import { measured, type UnitSystem } from '../words/units';

export interface FollowPlace {
  readonly northM: number;
  readonly eastM: number;
  readonly upM: number;
}

/** Horizontally or vertically, from the leader and from its other followers. */
export const APART_M = 8;
/** North, east and above, each. */
export const MAX_OFFSET_M = 100;
export const FOLLOW_FOR_S = 600;

export type FollowSide = 'behind' | 'behind-left' | 'behind-right' | 'left' | 'right' | 'ahead' | 'above' | 'metres';

export const FOLLOW_SIDES: readonly { readonly value: FollowSide; readonly label: string }[] = [
  { value: 'behind', label: 'Behind it' },
  { value: 'behind-left', label: 'Behind, left' },
  { value: 'behind-right', label: 'Behind, right' },
  { value: 'left', label: 'Left of it' },
  { value: 'right', label: 'Right of it' },
  { value: 'ahead', label: 'Ahead of it' },
  { value: 'above', label: 'Above it' },
  { value: 'metres', label: 'North, east, above' },
];

/** Clockwise from the leader's direction. */
const TURNED_DEG: Record<Exclude<FollowSide, 'above' | 'metres'>, number> = {
  ahead: 0,
  right: 90,
  'behind-right': 135,
  behind: 180,
  'behind-left': 225,
  left: 270,
};

/** Compensates rounding of a minimum distance: the tower compares exactly. */
const SLACK_M = 0.01;
const rounded = (metres: number): number => Math.round(metres * 1000) / 1000 || 0;
/** The slack must not exceed the upper bound either. */
const within = (metres: number): number =>
  Math.abs(metres) <= MAX_OFFSET_M + SLACK_M ? Math.max(-MAX_OFFSET_M, Math.min(MAX_OFFSET_M, metres)) : metres;

/** This far horizontally from the leader, on the side `turnedDeg` clockwise from `headingDeg`. */
export function placeAround(headingDeg: number, turnedDeg: number, awayM: number, upM: number): FollowPlace {
  const bearing = ((headingDeg + turnedDeg) * Math.PI) / 180;
  const metres = awayM + SLACK_M;
  return {
    northM: within(rounded(Math.cos(bearing) * metres)),
    eastM: within(rounded(Math.sin(bearing) * metres)),
    upM: rounded(upM),
  };
}

/** `headingDeg`: the leader's current direction. Directly above it, the horizontal offset is zero. */
export function placeBeside(
  side: Exclude<FollowSide, 'metres'>,
  headingDeg: number,
  awayM: number,
  upM: number,
): FollowPlace {
  return side === 'above'
    ? { northM: 0, eastM: 0, upM: rounded(upM) }
    : placeAround(headingDeg, TURNED_DEG[side], awayM, upM);
}

const isApart = (northM: number, eastM: number, upM: number): boolean =>
  Math.hypot(northM, eastM) >= APART_M || Math.abs(upM) >= APART_M;

/** Whether two places at the same leader are far enough apart. */
export const arePlacesApart = (one: FollowPlace, other: FollowPlace): boolean =>
  isApart(one.northM - other.northM, one.eastM - other.eastM, one.upM - other.upM);

/** Why this place is not allowed, in words; empty if it is. */
export function placeFault({ northM, eastM, upM }: FollowPlace, units: UnitSystem): string {
  const far = [northM, eastM, upM].some((metres) => !(Math.abs(metres) <= MAX_OFFSET_M));
  if (far) return `${measured(units, 'distance', MAX_OFFSET_M)} to the north, to the east and in height are the most.`;
  if (!isApart(northM, eastM, upM))
    return `Too near: ${measured(units, 'distance', APART_M)} over ground or in height are the least.`;
  return '';
}

const WINDS = ['north', 'north-east', 'east', 'south-east', 'south', 'south-west', 'west', 'north-west'] as const;

/** "14 m south-west of Merlin and 3 m above it". */
export function placeWords({ northM, eastM, upM }: FollowPlace, leader: string, units: UnitSystem): string {
  const awayM = Math.hypot(northM, eastM);
  const height = measured(units, 'height', Math.abs(upM), Number.isInteger(upM) ? 0 : 1);
  const level = upM === 0 ? '' : `${height} ${upM > 0 ? 'above' : 'below'}`;
  if (awayM < 0.5) return `${level || 'right at'} ${leader}`;
  const wind = WINDS[Math.round(Math.atan2(eastM, northM) / (Math.PI / 4) + 8) % 8]!;
  return `${measured(units, 'distance', awayM)} ${wind} of ${leader}${level && ` and ${level} it`}`;
}

/** What ends it, for the question and for watchers. */
export const endWords = (leader: string, units: UnitSystem): string =>
  `It holds where it is when ${leader} lands or is lost, comes nearer than ${measured(units, 'distance', 5)}, is more than ` +
  `${measured(units, 'distance', 200)} away, or after ${FOLLOW_FOR_S / 60} minutes. Any other command ends it too.`;
