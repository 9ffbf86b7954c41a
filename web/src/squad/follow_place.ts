/**
 * A follower's place beside its leader: metres north, east and above, independent of the leader's heading. The tower
 * and the agent refuse the same values (wire/following.py).
 */

import { t } from '../languages/text';
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
  { value: 'behind', label: t('Behind it') },
  { value: 'behind-left', label: t('Behind, left') },
  { value: 'behind-right', label: t('Behind, right') },
  { value: 'left', label: t('Left of it') },
  { value: 'right', label: t('Right of it') },
  { value: 'ahead', label: t('Ahead of it') },
  { value: 'above', label: t('Above it') },
  { value: 'metres', label: t('North, east, above') },
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
  if (far)
    return t('{distance} to the north, to the east and in height are the most.', {
      distance: measured(units, 'distance', MAX_OFFSET_M),
    });
  if (!isApart(northM, eastM, upM))
    return t('Too near: {distance} over ground or in height are the least.', {
      distance: measured(units, 'distance', APART_M),
    });
  return '';
}

const WINDS = [
  t('north'),
  t('north-east'),
  t('east'),
  t('south-east'),
  t('south'),
  t('south-west'),
  t('west'),
  t('north-west'),
];

/** "14 m south-west of Merlin and 3 m above it". */
export function placeWords({ northM, eastM, upM }: FollowPlace, leader: string, units: UnitSystem): string {
  const awayM = Math.hypot(northM, eastM);
  const height = measured(units, 'height', Math.abs(upM), Number.isInteger(upM) ? 0 : 1);
  const level = upM === 0 ? '' : upM > 0 ? t('{height} above', { height }) : t('{height} below', { height });
  if (awayM < 0.5) return `${level || t('right at')} ${leader}`;
  const wind = WINDS[Math.round(Math.atan2(eastM, northM) / (Math.PI / 4) + 8) % 8]!;
  return t('{distance} {wind} of {leader}{level}', {
    distance: measured(units, 'distance', awayM),
    wind,
    leader,
    level: level && ` ${t('and {level} it', { level })}`,
  });
}

/** What ends it, for the question and for watchers. */
export const endWords = (leader: string, units: UnitSystem): string =>
  t(
    'It holds where it is when {leader} lands or is lost, comes nearer than {distance}, is more than {distance2} away, or after {followFor} minutes. Any other command ends it too.',
    {
      leader,
      distance: measured(units, 'distance', 5),
      distance2: measured(units, 'distance', 200),
      followFor: FOLLOW_FOR_S / 60,
    },
  );
