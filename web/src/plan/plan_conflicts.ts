/**
 * Several plans flown at the same time: where drones come near each other, by their estimated times, and where only
 * these times separate them. Each finding names the drones. Wind, a late start or a pause are not in the estimates, so
 * a crossing counts within a slack of time.
 */

import { inLanguage, t } from '../languages/text';
import type { FlightFigures } from './estimates';
import { Plane, type Point } from './ground';
import { latDegOf, lonDegOf, type Plan, type Spot } from './plan_types';
import { closestOfSegments, whenNear, type Moving } from './near_ways';
import { timedPath, type TimedPath } from './timed_path';

/** One drone with its plan. `startS`: seconds after the first start. */
export interface PlannedFlight {
  readonly name: string;
  readonly plan: Plan;
  readonly figures: FlightFigures;
  readonly startS: number;
}

/** Two drones conflict while both distances are below these. */
export interface SeparationWanted {
  readonly horizontalM: number;
  readonly verticalM: number;
}

export interface PlanConflict {
  /**
   * `near`: estimated to be near each other at the same time. `crossing`: one after the other, with little time
   * between.
   */
  readonly kind: 'near' | 'crossing';
  readonly severity: 'error' | 'warning';
  /** Indices in the list of flights. */
  readonly pair: readonly [number, number];
  /** Since the first start; for a crossing, when the first of the two arrives. */
  readonly atS: number;
  /** For a crossing: how much later the other one arrives. */
  readonly gapS: number;
  readonly spot: Spot;
  readonly horizontalM: number;
  readonly verticalM: number;
  /** The items that they fly to. */
  readonly seqs: readonly [number, number];
  readonly words: string;
}

/**
 * The smallest horizontal distance of two drones while their vertical distance is below the required one; null: never.
 */
export interface Closest {
  readonly pair: readonly [number, number];
  readonly atS: number;
  readonly horizontalM: number;
  readonly verticalM: number;
}

export interface ConflictReport {
  /** Earliest first; at most MAX_PER_PAIR per pair, including its nearest one. */
  readonly conflicts: readonly PlanConflict[];
  readonly closest: readonly Closest[];
  /** What could not be checked, in words. */
  readonly notes: readonly string[];
}

export const MAX_PER_PAIR = 5;
/** Crossings separated by more time than this plus a share of the flown time do not count. */
const SLACK_S = 20;
const SLACK_SHARE = 0.1;
/** Conflicts with less time between them are merged. */
const SAME_EPISODE_S = 3;
const GROUND_M = 0.3;

interface Piece {
  readonly fromS: number;
  readonly toS: number;
  readonly from: Point;
  readonly to: Point;
  readonly fromM: number;
  readonly toM: number;
  readonly seq: number;
  readonly reachM: number;
}

interface Way {
  readonly name: string;
  readonly pieces: readonly Piece[];
  readonly startS: number;
}

const timeWords = (seconds: number): string => {
  const whole = Math.round(seconds);
  const [minutes, rest] = [Math.floor(whole / 60), whole % 60];
  if (minutes === 0) return `${rest} s`;
  return rest === 0 ? `${minutes} min` : `${minutes} min ${rest} s`;
};
const metres = (value: number): string => `${value < 10 ? inLanguage(value.toFixed(1)) : Math.round(value)} m`;
const placeWords = (spot: Spot): string => `${latDegOf(spot).toFixed(5)}, ${lonDegOf(spot).toFixed(5)}`;

export function planConflicts(flights: readonly PlannedFlight[], wanted: SeparationWanted): ConflictReport {
  const paths = flights.map(({ plan, figures }) => timedPath(plan, figures));
  const notes = notesOf(flights, paths);
  const middle = paths.flatMap(({ pieces }) => pieces)[0]?.from;
  if (!middle) return { conflicts: [], closest: [], notes };
  const plane = new Plane(middle);
  const overS = Math.max(...paths.map(({ seconds }, at) => seconds + flights[at]!.startS));
  // Heights above different homes are comparable only if the homes' heights are known.
  const isAboveSea = flights.every(({ plan }) => plan.home !== null);
  const ways = flights.map((flight, at) => wayOf(flight, paths[at]!, plane, isAboveSea, overS));
  const conflicts: PlanConflict[] = [];
  const closest: Closest[] = [];
  for (let one = 0; one < ways.length; one += 1) {
    for (let other = one + 1; other < ways.length; other += 1) {
      const pair = [one, other] as const;
      const met = meetings(ways[one]!, ways[other]!, wanted);
      if (met.closest) closest.push({ pair, ...met.closest });
      const named = met.near.map((meeting) => nearConflict(pair, ways, meeting, plane));
      conflicts.push(...mostRelevant(named));
      const crossing = worstCrossing(pair, ways, wanted, plane, met.near);
      if (crossing) conflicts.push(crossing);
    }
  }
  conflicts.sort((a, b) => a.atS - b.atS);
  return { conflicts, closest, notes };
}

function notesOf(flights: readonly PlannedFlight[], paths: readonly TimedPath[]): string[] {
  const notes: string[] = [];
  for (const [at, { ending, staysUp, pieces }] of paths.entries()) {
    const { name } = flights[at]!;
    if (pieces.length === 0) notes.push(t('{name} flies nowhere: nothing of it is checked.', { name }));
    else if (ending === 'for-ever')
      notes.push(t('{name} goes round for ever: its first time round is checked.', { name }));
    else if (ending === 'too-long')
      notes.push(t('The mission of {name} jumps too often to be followed to its end.', { name }));
    else if (staysUp)
      notes.push(
        t('{name} stays in the air where its mission ends: it counts as being there until all are done.', { name }),
      );
  }
  if (flights.some(({ plan }) => plan.home === null) && flights.length > 1) {
    notes.push(t('Not every plan has a home: heights are compared as if all started equally high.'));
  }
  return notes;
}

function wayOf(flight: PlannedFlight, path: TimedPath, plane: Plane, isAboveSea: boolean, overS: number): Way {
  const { name, plan, startS } = flight;
  const baseM = isAboveSea ? plan.home!.altM : 0;
  const pieces: Piece[] = [];
  for (const piece of path.pieces) {
    // A drone on the ground conflicts with nobody.
    if (Math.max(piece.fromHeightM, piece.toHeightM) <= GROUND_M || piece.toS <= piece.fromS) continue;
    pieces.push({
      fromS: startS + piece.fromS,
      toS: startS + piece.toS,
      from: plane.point(piece.from),
      to: plane.point(piece.to),
      fromM: baseM + piece.fromHeightM,
      toM: baseM + piece.toHeightM,
      seq: piece.seq,
      reachM: piece.reachM,
    });
  }
  const last = pieces.at(-1);
  if (path.staysUp && last && last.toS < overS) {
    pieces.push({ ...last, fromS: last.toS, toS: overS, from: last.to, fromM: last.toM, reachM: 0 });
  }
  return { name, pieces, startS };
}

interface Meeting {
  readonly fromS: number;
  readonly toS: number;
  readonly atS: number;
  readonly horizontalM: number;
  readonly verticalM: number;
  readonly at: Point;
  readonly seqs: readonly [number, number];
}

const between = (from: number, to: number, part: number): number => from + (to - from) * part;

function placeAt(piece: Piece, atS: number): { point: Point; heightM: number } {
  const part = (atS - piece.fromS) / (piece.toS - piece.fromS);
  const [x, y] = [between(piece.from[0], piece.to[0], part), between(piece.from[1], piece.to[1], part)];
  return { point: [x, y], heightM: between(piece.fromM, piece.toM, part) };
}

/** The second drone's motion relative to the first, from `fromS` on. */
function relative(one: Piece, other: Piece, fromS: number): Moving {
  const [a, b] = [placeAt(one, fromS), placeAt(other, fromS)];
  const speed = (piece: Piece) => {
    const seconds = piece.toS - piece.fromS;
    return [
      (piece.to[0] - piece.from[0]) / seconds,
      (piece.to[1] - piece.from[1]) / seconds,
      (piece.toM - piece.fromM) / seconds,
    ] as const;
  };
  const [u, v] = [speed(one), speed(other)];
  return {
    place: [b.point[0] - a.point[0], b.point[1] - a.point[1], b.heightM - a.heightM],
    speed: [v[0] - u[0], v[1] - u[1], v[2] - u[2]],
  };
}

/** Walks both paths in parallel: yields each time span in which both fly straight. */
function meetings(
  one: Way,
  other: Way,
  wanted: SeparationWanted,
): { near: Meeting[]; closest: Omit<Closest, 'pair'> | null } {
  const near: Meeting[] = [];
  let closest: Omit<Closest, 'pair'> | null = null;
  let [i, j] = [0, 0];
  while (i < one.pieces.length && j < other.pieces.length) {
    const [a, b] = [one.pieces[i]!, other.pieces[j]!];
    const [fromS, toS] = [Math.max(a.fromS, b.fromS), Math.min(a.toS, b.toS)];
    if (toS > fromS) {
      const moving = relative(a, b, fromS);
      const reachM = a.reachM + b.reachM;
      const lowest = whenNear(moving, Infinity, wanted.verticalM, toS - fromS);
      if (lowest) {
        const horizontalM = Math.max(0, lowest.horizontalM - reachM);
        if (!closest || horizontalM < closest.horizontalM) {
          closest = { atS: fromS + lowest.closestS, horizontalM, verticalM: lowest.verticalM };
        }
      }
      const found = whenNear(moving, wanted.horizontalM + reachM, wanted.verticalM, toS - fromS);
      if (found) {
        const atS = fromS + found.closestS;
        const [p, q] = [placeAt(a, atS).point, placeAt(b, atS).point];
        addMeeting(near, {
          fromS: fromS + found.fromS,
          toS: fromS + found.toS,
          atS,
          horizontalM: Math.max(0, found.horizontalM - reachM),
          verticalM: found.verticalM,
          at: [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2],
          seqs: [a.seq, b.seq],
        });
      }
    }
    if (a.toS <= b.toS) i += 1;
    else j += 1;
  }
  return { near, closest };
}

function addMeeting(near: Meeting[], next: Meeting): void {
  const last = near.at(-1);
  if (!last || next.fromS - last.toS > SAME_EPISODE_S) {
    near.push(next);
    return;
  }
  const nearer = next.horizontalM < last.horizontalM ? next : last;
  near[near.length - 1] = { ...nearer, fromS: last.fromS, toS: next.toS };
}

function nearConflict(
  pair: readonly [number, number],
  ways: readonly Way[],
  meeting: Meeting,
  plane: Plane,
): PlanConflict {
  const [one, other] = [ways[pair[0]]!.name, ways[pair[1]]!.name];
  const { horizontalM, verticalM, atS, fromS, toS, seqs } = meeting;
  const lasts = toS - fromS >= 1 ? t(', for {time}', { time: timeWords(toS - fromS) }) : '';
  const words = t(
    '{one} and {other} come within {horizontal} of each other ({vertical} in height) {time} after the first start{lasts}: {one} on the way to item {seqs}, {other} to item {seqs2}.',
    {
      one,
      other,
      horizontal: metres(horizontalM),
      vertical: metres(verticalM),
      time: timeWords(atS),
      lasts,
      seqs: seqs[0] + 1,
      seqs2: seqs[1] + 1,
    },
  );
  const spot = plane.spot(meeting.at);
  return { kind: 'near', severity: 'error', pair, atS, gapS: 0, spot, horizontalM, verticalM, seqs, words };
}

/** The earliest and the nearest. */
function mostRelevant(all: readonly PlanConflict[]): PlanConflict[] {
  if (all.length <= MAX_PER_PAIR) return [...all];
  const nearest = all.reduce((best, one) => (one.horizontalM < best.horizontalM ? one : best));
  const first = all.filter((one) => one !== nearest).slice(0, MAX_PER_PAIR - 1);
  return [...first, nearest];
}

/** For two paths that touch without a simultaneous encounter: the crossing with the least time between. */
function worstCrossing(
  pair: readonly [number, number],
  ways: readonly Way[],
  wanted: SeparationWanted,
  plane: Plane,
  near: readonly Meeting[],
): PlanConflict | null {
  const [one, other] = [ways[pair[0]]!, ways[pair[1]]!];
  const inNear = (atS: number): boolean =>
    near.some(({ fromS, toS }) => atS >= fromS - SLACK_S && atS <= toS + SLACK_S);
  let worst: {
    gapS: number;
    atS: number;
    at: Point;
    horizontalM: number;
    verticalM: number;
    seqs: [number, number];
    oneIsFirst: boolean;
  } | null = null;
  let places = 0;
  for (const a of one.pieces) {
    const slackS = SLACK_S + SLACK_SHARE * (a.toS - one.startS);
    for (const b of other.pieces) {
      if (b.fromS - a.toS > slackS || a.fromS - b.toS > slackS) continue;
      const reachM = wanted.horizontalM + a.reachM + b.reachM;
      if (isApart(a, b, reachM, wanted.verticalM)) continue;
      const found = closestOfSegments(solid(a), solid(b), reachM / wanted.verticalM);
      if (found.horizontalM >= reachM || found.verticalM >= wanted.verticalM) continue;
      const [oneS, otherS] = [between(a.fromS, a.toS, found.parts[0]), between(b.fromS, b.toS, found.parts[1])];
      const gapS = Math.abs(oneS - otherS);
      if (gapS > slackS || inNear(oneS) || inNear(otherS)) continue;
      places += 1;
      if (worst && gapS >= worst.gapS) continue;
      const horizontalM = Math.max(0, found.horizontalM - a.reachM - b.reachM);
      const seqs: [number, number] = [a.seq, b.seq];
      const atS = Math.min(oneS, otherS);
      worst = { gapS, atS, at: found.at, horizontalM, verticalM: found.verticalM, seqs, oneIsFirst: oneS <= otherS };
    }
  }
  if (!worst) return null;
  const { gapS, atS, horizontalM, verticalM, seqs, oneIsFirst } = worst;
  const spot = plane.spot(worst.at);
  const [first, second] = oneIsFirst ? [one.name, other.name] : [other.name, one.name];
  const [firstSeq, secondSeq] = oneIsFirst ? seqs : [seqs[1], seqs[0]];
  const more = places > 1 ? ` ${t('Their ways touch elsewhere too.')}` : '';
  const words = t(
    'The ways of {first} (to item {firstSeq}) and {second} (to item {secondSeq}) come within {horizontal} of each other ({vertical} in height) at {place}: only {time} between them keep them apart.{more}',
    {
      first,
      firstSeq: firstSeq + 1,
      second,
      secondSeq: secondSeq + 1,
      horizontal: metres(horizontalM),
      vertical: metres(verticalM),
      place: placeWords(spot),
      time: timeWords(gapS),
      more,
    },
  );
  return { kind: 'crossing', severity: 'warning', pair, atS, gapS, spot, horizontalM, verticalM, seqs, words };
}

function isApart(a: Piece, b: Piece, horizontalM: number, verticalM: number): boolean {
  const gap = (a1: number, a2: number, b1: number, b2: number): number =>
    Math.max(Math.min(b1, b2) - Math.max(a1, a2), Math.min(a1, a2) - Math.max(b1, b2));
  return (
    gap(a.from[0], a.to[0], b.from[0], b.to[0]) >= horizontalM ||
    gap(a.from[1], a.to[1], b.from[1], b.to[1]) >= horizontalM ||
    gap(a.fromM, a.toM, b.fromM, b.toM) >= verticalM
  );
}

const solid = ({ from, to, fromM, toM }: Piece) => ({
  from: [from[0], from[1], fromM] as const,
  to: [to[0], to[1], toM] as const,
});
