/**
 * One task for several drones: an area split among them, or the same plan at different heights. Returns a plan for
 * each, estimates, and conflicts. Pure: recomputed with each change of the drawing or the settings.
 */

import { plural, t } from '../languages/text';
import { CMD, specOf } from '../plan/catalogue';
import { estimate, USUAL_FIGURES, type Estimate } from '../plan/estimates';
import { FRAME } from '../plan/frames';
import { flownPath, type GroundAt } from '../plan/flown_path';
import { distanceM } from '../plan/ground';
import { planChecks, type CheckLimits, type Finding } from '../plan/plan_checks';
import { planConflicts, type ConflictReport, type SeparationWanted } from '../plan/plan_conflicts';
import { EMPTY_PLAN, type Plan, type PlannedHome, type Spot, type WireItem } from '../plan/plan_types';
import { Drawing, SurveyFault } from '../plan/survey/area';
import { splitArea } from '../plan/survey/area_split';
import { followGround } from '../plan/survey/follow_ground';
import { gridLines, lineItems, type GridSettings } from '../plan/survey/survey_grid';
import { itemsOf, planItems, wireItem } from '../plan/wire_items';

export interface Member {
  readonly id: number;
  readonly name: string;
  /** Its position on the ground, or its home in flight; null: not reported. */
  readonly home: PlannedHome | null;
  readonly autopilot: CheckLimits['autopilot'];
}

/** `split`: an area in strips, one for each. `stack`: all fly the same plan, each higher than the one before. */
export type SquadMode = 'split' | 'stack';

export interface SquadSettings {
  readonly mode: SquadMode;
  /** Above home, or above the ground. */
  readonly heightM: number;
  /** Whether surveys keep their height above the ground, all the way from home and back. */
  readonly overGround: boolean;
  /** By how much that height may differ between two waypoints. */
  readonly toleranceM: number;
  /** Height difference from one drone to the next. */
  readonly stepM: number;
  readonly speedMS: number;
  readonly spacingM: number;
  readonly turnaroundM: number;
  /** Between pictures; 0: none. */
  readonly triggerM: number;
  readonly angleDeg: number;
  /** Between one start and the next. */
  readonly startEveryS: number;
  readonly wanted: SeparationWanted;
}

export const USUAL_SQUAD: SquadSettings = {
  mode: 'split',
  heightM: 40,
  overGround: false,
  toleranceM: 2,
  stepM: 0,
  speedMS: 5,
  spacingM: 25,
  turnaroundM: 0,
  triggerM: 0,
  angleDeg: 0,
  startEveryS: 5,
  wanted: { horizontalM: 15, verticalM: 10 },
};

/** The task: an area, or (stacked) an existing plan. */
export type SquadJob = { readonly area: readonly Spot[] } | { readonly plan: Plan };

export interface SquadPart {
  readonly member: Member;
  /** Its index among the selected drones: its colour is independent of the order of starts. */
  readonly number: number;
  readonly plan: Plan;
  /** Its part of the area; empty if the area is not split. */
  readonly area: readonly Spot[];
  readonly estimate: Estimate;
  readonly startS: number;
  /** For its plan alone. */
  readonly findings: readonly Finding[];
}

export interface SquadPlan {
  readonly parts: readonly SquadPart[];
  readonly report: ConflictReport;
  /** Why there are no parts, for people; empty while input is only missing. */
  readonly fault: string;
}

export const MAX_MEMBERS = 20;
/** The least height of a way above the ground, as for the plan of one drone. */
const CLEARANCE_M = 10;
const ENTRIES = [0, 1, 2, 3] as const;
const NOTHING: ConflictReport = { conflicts: [], closest: [], notes: [] };
const none = (fault = ''): SquadPlan => ({ parts: [], report: NOTHING, fault });

export function squadPlan(members: readonly Member[], job: SquadJob, settings: SquadSettings): SquadPlan {
  const hasJob = 'plan' in job ? job.plan.items.length > 0 : job.area.length >= 3;
  if (members.length === 0 || !hasJob) return none();
  if (members.length > MAX_MEMBERS)
    return none(t('{maxMembers} drones are the most for one job.', { maxMembers: MAX_MEMBERS }));
  const lost = members.filter(({ home }) => home === null).map(({ name }) => name);
  if (lost.length > 0)
    return none(
      plural(
        lost.length,
        { one: 'The position of {lost} is not known.', other: 'The positions of {lost} are not known.' },
        { lost: listWords(lost) },
      ),
    );
  try {
    if ('plan' in job)
      return whole(
        members,
        members.map((member, at) => raised(job.plan, member, at * settings.stepM)),
        settings,
      );
    return settings.mode === 'split' ? split(members, job.area, settings) : stacked(members, job.area, settings);
  } catch (error) {
    if (error instanceof SurveyFault) return none(error.message);
    throw error;
  }
}

/**
 * The same with the ground under it, which arrives piece by piece: surveys are laid over it if the settings say so, all
 * ways are checked against it, and conflicts are judged by the heights that are then flown.
 */
export function onGround(flat: SquadPlan, job: SquadJob, settings: SquadSettings, ground: GroundAt): SquadPlan {
  if (flat.parts.length === 0) return flat;
  const members = flat.parts.map(({ member }) => member);
  const chosen = flat.parts.toSorted((one, other) => one.number - other.number).map(({ member }) => member);
  const isLaid = settings.overGround && !('plan' in job);
  try {
    const drawn = flat.parts.map(({ plan, area }, at): Drawn => {
      return { plan: isLaid ? laid(plan, settings.heightM + at * settings.stepM, settings, ground) : plan, area };
    });
    return whole(members, drawn, settings, chosen, ground);
  } catch (error) {
    if (error instanceof SurveyFault) return none(error.message);
    throw error;
  }
}

export const listWords = (names: readonly string[]): string =>
  names.length < 2
    ? (names[0] ?? '')
    : t('{names} and {last}', { names: names.slice(0, -1).join(', '), last: names.at(-1)! });

interface Drawn {
  readonly plan: Plan;
  readonly area: readonly Spot[];
}

/** `chosen`: in their own order, if the order of starts differs. */
function whole(
  members: readonly Member[],
  drawn: readonly Drawn[],
  settings: SquadSettings,
  chosen: readonly Member[] = members,
  ground: GroundAt | null = null,
): SquadPlan {
  const parts = members.map((member, at): SquadPart => {
    const { plan, area } = drawn[at]!;
    const path = flownPath(plan, ground ?? undefined);
    const under = ground && { ground: { at: ground, clearanceM: CLEARANCE_M, returnHeightM: null } };
    const limits = { autopilot: member.autopilot, highestM: null, farthestM: null, ...under };
    return {
      member,
      number: chosen.indexOf(member),
      plan,
      area,
      estimate: estimate(plan, USUAL_FIGURES, path),
      startS: at * settings.startEveryS,
      findings: planChecks(plan, limits, path),
    };
  });
  const flights = parts.map(({ member, plan, startS }) => ({
    name: member.name,
    plan,
    figures: USUAL_FIGURES,
    startS,
  }));
  return { parts, report: planConflicts(flights, settings.wanted), fault: '' };
}

/**
 * Limits the search for a split without conflicts to this many pairs of paths: as long as a user waits after a key
 * press.
 */
const MAX_PAIRS_CHECKED = 75;

/**
 * Strips side by side, flown from the same corner, so that neighbours stay a strip apart. The drones' positions
 * determine the assignment, so that their ways there do not cross. If that still conflicts (one climbs where another
 * flies over it), this tries other corners, the reverse order of starts and exchanged neighbours: the fewest conflicts
 * win, then the shortest flights.
 */
function split(members: readonly Member[], area: readonly Spot[], settings: SquadSettings): SquadPlan {
  const strips = splitArea(area, members.length, settings.angleDeg);
  const drawing = new Drawing(area, settings.angleDeg);
  const across = ({ home }: Member): number => drawing.point(home!.spot)[1];
  const standing = [...members].sort((one, other) => across(one) - across(other));
  const pairs = Math.max(1, (members.length * (members.length - 1)) / 2);
  let left = Math.max(ENTRIES.length, Math.floor(MAX_PAIRS_CHECKED / pairs));
  let best: SquadPlan | null = null;
  let least = Infinity;
  for (const order of exchanged(standing)) {
    const stripOf = new Map(order.map(({ id }, place) => [id, strips[place]!]));
    for (const starts of [members, members.toReversed()]) {
      for (const entry of ENTRIES) {
        if (left === 0 || least < COST.conflict) return best!;
        left -= 1;
        const drawn = starts.map((member, at): Drawn => {
          const strip = stripOf.get(member.id)!;
          return { plan: survey(member, strip, settings, settings.heightM + at * settings.stepM, entry), area: strip };
        });
        const found = whole(starts, drawn, settings, members);
        const cost = costOf(found);
        if (cost < least) [best, least] = [found, cost];
      }
    }
  }
  return best!;
}

const COST = { error: 1e9, conflict: 1e7 } as const;

const costOf = ({ parts, report }: SquadPlan): number =>
  report.conflicts.filter(({ severity }) => severity === 'error').length * COST.error +
  report.conflicts.length * COST.conflict +
  parts.reduce((sum, part) => sum + part.estimate.seconds, 0);

/** In their original order, then with two of them exchanged, nearest pairs first. */
function* exchanged(standing: readonly Member[]): Generator<readonly Member[]> {
  yield standing;
  for (let gap = 1; gap < standing.length; gap += 1) {
    for (let at = 0; at + gap < standing.length; at += 1) {
      yield standing.with(at, standing[at + gap]!).with(at + gap, standing[at]!);
    }
  }
}

function stacked(members: readonly Member[], area: readonly Spot[], settings: SquadSettings): SquadPlan {
  const homes = members.map(({ home }) => home!.spot);
  // The nearest corner for all: they fly the same lines.
  const entry = ENTRIES.reduce((best, next) =>
    toBegin(homes, area, settings, next) < toBegin(homes, area, settings, best) ? next : best,
  );
  const drawn = members.map((member, at): Drawn => {
    return { plan: survey(member, area, settings, settings.heightM + at * settings.stepM, entry), area: [] };
  });
  return whole(members, drawn, settings);
}

const grid = (settings: SquadSettings, heightM: number, entry: GridSettings['entry']): GridSettings => ({
  heightM,
  frame: FRAME.GLOBAL_RELATIVE_ALT,
  triggerM: settings.triggerM > 0 ? settings.triggerM : null,
  spacingM: settings.spacingM,
  angleDeg: settings.angleDeg,
  turnaroundM: settings.turnaroundM,
  entry,
});

function toBegin(
  homes: readonly Spot[],
  area: readonly Spot[],
  settings: SquadSettings,
  entry: GridSettings['entry'],
): number {
  const [first] = gridLines(area, grid(settings, settings.heightM, entry));
  return first ? homes.reduce((sum, home) => sum + distanceM(home, first.from), 0) : 0;
}

/** Climb, survey the area, and return home. */
function survey(
  member: Member,
  area: readonly Spot[],
  settings: SquadSettings,
  heightM: number,
  entry: GridSettings['entry'],
): Plan {
  const flown = grid(settings, heightM, entry);
  const items: WireItem[] = [
    wireItem(CMD.TAKEOFF, FRAME.GLOBAL_RELATIVE_ALT, [0, 0, 0, null], 0, 0, heightM),
    wireItem(CMD.CHANGE_SPEED, FRAME.MISSION, [1, settings.speedMS, -1, 0], 0, 0, 0),
    ...lineItems(gridLines(area, flown), flown),
    wireItem(CMD.RETURN, FRAME.MISSION, [0, 0, 0, 0], 0, 0, 0),
  ];
  const defaults = { heightM, frame: FRAME.GLOBAL_RELATIVE_ALT, speedMS: settings.speedMS };
  return { ...EMPTY_PLAN, home: member.home, items: planItems(items, 1), defaults, nextId: items.length + 1 };
}

/** A survey at a constant height above the ground, from above its home and back there: hills may lie on the way. */
function laid(plan: Plan, heightM: number, settings: SquadSettings, ground: GroundAt): Plan {
  const home = plan.home?.spot ?? null;
  const flat = itemsOf(plan, 'mission');
  const first = flat.findIndex(({ command }) => command === CMD.WAYPOINT);
  if (first < 0 || !home) return plan;
  const above = wireItem(CMD.WAYPOINT, FRAME.GLOBAL_RELATIVE_ALT, [0, 0, 0, null], home.latE7, home.lonE7, heightM);
  const way = [above, ...flat.slice(first, -1), above];
  const { toleranceM } = settings;
  const followed = followGround(way, { heightM, toleranceM, home, ground }).slice(1);
  const items = [...flat.slice(0, first), ...followed, ...flat.slice(-1)];
  return { ...plan, items: planItems(items, 1), nextId: items.length + 1 };
}

/** Raises a plan's places in flight, but not its landing. It is flown from this drone's own home. */
function raised(plan: Plan, member: Member, byM: number): Drawn {
  const items = plan.items.map((item) => {
    const isLanding = item.command === CMD.LAND || item.command === CMD.VTOL_LAND;
    const flies = specOf(item.command)?.flies && item.command !== CMD.RETURN && !isLanding;
    return flies ? { ...item, z: Math.fround(item.z + byM) } : item;
  });
  return { plan: { ...plan, home: member.home, items }, area: [] };
}
