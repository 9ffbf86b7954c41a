/**
 * Several drones that follow one: assigns the places, and checks whether any drone comes too near to another on its
 * way. The ways are straight, and each drone starts when the one before is in place. Independent of any connection.
 */

import { t } from '../languages/text';
import type { Place } from '../link/messages';
import { APART_M, arePlacesApart, placeAround, placeFault, type FollowPlace } from './follow_place';
import type { UnitSystem } from '../words/units';

export type FormationShape = 'line' | 'v' | 'column';

export interface FormationSettings {
  readonly shape: FormationShape;
  /** Horizontally, from one place to the next. */
  readonly spacingM: number;
  /** Each place is higher than the one before by this; the first is higher than the leader. */
  readonly stepM: number;
  /** Orientation of the formation: it does not turn with the leader. */
  readonly headingDeg: number;
}

export const USUAL_FORMATION: FormationSettings = { shape: 'v', spacingM: 15, stepM: 2, headingDeg: 0 };
/** This many fit within the tower's bounds, and their names fit on a screen. */
export const MAX_FOLLOWERS = 6;

export interface Flier {
  readonly id: number;
  readonly name: string;
  readonly place: Place;
  /** Above sea level. */
  readonly altM: number;
}

export interface Assigned {
  readonly follower: Flier;
  readonly place: FollowPlace;
}

/** In the order of departure. `faults`: why it must not be flown, for people. */
export interface Formation {
  readonly assigned: readonly Assigned[];
  readonly faults: readonly string[];
}

/** The places of this many followers. A line is abreast of the leader, alternately to its right and left. */
export function formationPlaces(settings: FormationSettings, count: number): FollowPlace[] {
  const { shape, spacingM, stepM, headingDeg } = settings;
  return Array.from({ length: count }, (_, at) => {
    const rank = Math.floor(at / 2) + 1;
    const side = at % 2 === 0 ? 1 : -1;
    const [turnedDeg, awayM] =
      shape === 'column'
        ? [180, spacingM * (at + 1)]
        : shape === 'line'
          ? [side * 90, spacingM * rank]
          : [side * 135, spacingM * rank];
    // Slightly more with each, so that rounding does not go below the minimum.
    return placeAround(headingDeg, turnedDeg, awayM + 0.01 * rank, stepM * (at + 1));
  });
}

/** Metres north, east and above the leader. */
interface Spot {
  readonly n: number;
  readonly e: number;
  readonly u: number;
}

const METRES_PER_DEGREE = 111_195;

function spotFrom(leader: Flier, { place, altM }: Flier): Spot {
  const shrunk = Math.cos((leader.place.latDeg * Math.PI) / 180);
  const east = ((place.lonDeg - leader.place.lonDeg + 540) % 360) - 180;
  return {
    n: (place.latDeg - leader.place.latDeg) * METRES_PER_DEGREE,
    e: east * METRES_PER_DEGREE * shrunk,
    u: altM - leader.altM,
  };
}

const spotOf = ({ northM, eastM, upM }: FollowPlace): Spot => ({ n: northM, e: eastM, u: upM });

/** The smallest horizontal distance of the straight way to another drone, metres. */
function nearestOverGroundM(from: Spot, to: Spot, other: Spot): number {
  const [n, e] = [to.n - from.n, to.e - from.e];
  const length = n * n + e * e;
  const along = length === 0 ? 0 : ((other.n - from.n) * n + (other.e - from.e) * e) / length;
  const part = Math.max(0, Math.min(1, along));
  return Math.hypot(from.n + n * part - other.n, from.e + e * part - other.e);
}

/** At any height between both ends: the climb may come first or last. */
function passes(from: Spot, to: Spot, other: Spot): boolean {
  const clear = other.u >= Math.max(from.u, to.u) + APART_M || other.u <= Math.min(from.u, to.u) - APART_M;
  return !clear && nearestOverGroundM(from, to, other) < APART_M;
}

function waysTooNear(leader: Flier, assigned: readonly Assigned[]): string[] {
  const starts = assigned.map(({ follower }) => spotFrom(leader, follower));
  const ends = assigned.map(({ place }) => spotOf(place));
  return assigned.flatMap(({ follower }, at) => {
    const others = assigned
      .map((one, number) => ({ name: one.follower.name, spot: number < at ? ends[number]! : starts[number]!, number }))
      .filter(({ number }) => number !== at);
    return [{ name: leader.name, spot: { n: 0, e: 0, u: 0 } }, ...others]
      .filter(({ spot }) => passes(starts[at]!, ends[at]!, spot))
      .map(({ name }) =>
        t('On the straight way to its place {follower} comes too near to {name}.', { follower: follower.name, name }),
      );
  });
}

function* ordersOf<T>(all: readonly T[]): Generator<readonly T[]> {
  if (all.length < 2) {
    yield all;
    return;
  }
  for (const [at, first] of all.entries())
    for (const rest of ordersOf([...all.slice(0, at), ...all.slice(at + 1)])) yield [first, ...rest];
}

const wayM = (leader: Flier, { follower, place }: Assigned): number => {
  const [from, to] = [spotFrom(leader, follower), spotOf(place)];
  return Math.hypot(to.n - from.n, to.e - from.e, to.u - from.u);
};

/** Assigns the places: first so that no drone comes too near to another, then so that the ways are short. */
export function formationOf(
  leader: Flier,
  followers: readonly Flier[],
  settings: FormationSettings,
  units: UnitSystem,
): Formation {
  const places = formationPlaces(settings, followers.length);
  const faults = [...new Set(places.map((place) => placeFault(place, units)).filter((fault) => fault !== ''))];
  const areApart = places.every((one, at) => places.slice(at + 1).every((other) => arePlacesApart(one, other)));
  if (!areApart) faults.push(t('Their places are too near to each other: set more between them.'));
  if (followers.length > MAX_FOLLOWERS)
    faults.push(t('{maxFollowers} that follow are the most.', { maxFollowers: MAX_FOLLOWERS }));
  if (faults.length > 0) return { assigned: [], faults };
  let best: { assigned: readonly Assigned[]; near: readonly string[]; squares: number } | null = null;
  for (const order of ordersOf(followers)) {
    const forward = order.map((follower, at) => ({ follower, place: places[at]! }));
    for (const assigned of [forward, forward.toReversed()]) {
      const near = waysTooNear(leader, assigned);
      const squares = assigned.reduce((sum, one) => sum + wayM(leader, one) ** 2, 0);
      const isBetter = !best || near.length < best.near.length;
      if (isBetter || (near.length === best!.near.length && squares < best!.squares))
        best = { assigned, near, squares };
    }
  }
  return { assigned: best?.assigned ?? [], faults: best?.near ?? [] };
}
