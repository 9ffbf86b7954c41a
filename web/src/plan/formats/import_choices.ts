/**
 * From what a file has to the plan that replaces the present one: which routes, what its marks and outlines are for,
 * which heights. Says what that assumes and leaves out. Pure.
 */

import { plural, t } from '../../languages/text';
import { CMD } from '../catalogue';
import { frameWords } from '../frames';
import { cleanOutline } from '../outline';
import { MAX_ITEMS, type FencePolygon, type Plan, type RallyPoint, type WireItem } from '../plan_types';
import { planItems, wireItem } from '../wire_items';
import { shortFloat, type ReadFile } from './plan_file';
import type { FoundArea, FoundPlace } from './found_shapes';

export type MarkUse = 'leave' | 'waypoints' | 'rally';
export type AreaUse = 'leave' | 'inside' | 'outside' | 'survey';
/** The plan's default for all places; the file's heights where it says from where; or its others from this frame. */
export type HeightUse = 'plan' | 'file' | number;

export interface Choices {
  /** By their place in the file; several are flown one after the other. */
  readonly routes: ReadonlySet<number>;
  readonly marks: MarkUse;
  readonly heights: HeightUse;
  readonly areas: readonly AreaUse[];
}

interface Placed extends FoundPlace {
  readonly frame: number | null;
}

const routesOf = ({ routes = [] }: ReadFile) => routes;
const marksOf = ({ marks = [] }: ReadFile) => marks;

/** A single route is the route; of several, and of marks beside them, the user says which. */
export function firstChoices(read: ReadFile): Choices {
  const [routes, marks] = [routesOf(read), marksOf(read)];
  const isOnlyMarks = read.plan.items.length === 0 && routes.length === 0 && read.areas.length === 0;
  return {
    routes: new Set(routes.length === 1 ? [0] : []),
    marks: marks.length > 0 && isOnlyMarks ? 'waypoints' : 'leave',
    heights: allPlaces(read).some(({ frame, heightM }) => frame !== null && heightM !== null) ? 'file' : 'plan',
    areas: read.areas.map(() => 'leave'),
  };
}

const allPlaces = (read: ReadFile): Placed[] => [
  ...routesOf(read).flatMap(({ places, frame }) => places.map((place) => ({ ...place, frame }))),
  ...marksOf(read).map(({ place, frame }) => ({ ...place, frame })),
];

/** Whether the file has heights and says, or does not say, what they count from. */
export function heightsIn(read: ReadFile): { readonly stated: boolean; readonly unstated: boolean } {
  const given = allPlaces(read).filter(({ heightM }) => heightM !== null);
  return { stated: given.some(({ frame }) => frame !== null), unstated: given.some(({ frame }) => frame === null) };
}

function placesTaken(read: ReadFile, choices: Choices): { way: Placed[]; rally: Placed[] } {
  const way = routesOf(read).flatMap(({ places, frame }, at) =>
    choices.routes.has(at) ? places.map((place) => ({ ...place, frame })) : [],
  );
  const marks = marksOf(read).map(({ place, frame }) => ({ ...place, frame }));
  return {
    way: choices.marks === 'waypoints' ? [...way, ...marks] : way,
    rally: choices.marks === 'rally' ? marks : [],
  };
}

/** Null: the plan's default. */
function heightOf({ heightM, frame }: Placed, use: HeightUse): { frame: number; heightM: number } | null {
  if (use === 'plan' || heightM === null) return null;
  const from = frame ?? (use === 'file' ? null : use);
  return from === null ? null : { frame: from, heightM };
}

/** What the file has, as the user wants it. */
export function chosenPlan(read: ReadFile, choices: Choices): Plan {
  const { plan } = read;
  const { way, rally } = placesTaken(read, choices);
  const height = (place: Placed) => heightOf(place, choices.heights) ?? plan.defaults;
  const items = way.map((place): WireItem => {
    const { frame, heightM } = height(place);
    return wireItem(CMD.WAYPOINT, frame, [0, 0, 0, null], place.spot.latE7, place.spot.lonE7, heightM);
  });
  let nextId = plan.nextId + items.length;
  const shapes = read.areas.flatMap((area, at) => fencesOf(area, choices.areas[at] ?? 'leave'));
  return {
    ...plan,
    items: [...plan.items, ...planItems(items, plan.nextId)],
    fence: { ...plan.fence, shapes: [...plan.fence.shapes, ...shapes.map((one) => ({ ...one, id: nextId++ }))] },
    rally: [
      ...plan.rally,
      ...rally.map((place): RallyPoint => ({ id: nextId++, spot: place.spot, ...heightTaken(height(place)) })),
    ],
    nextId,
  };
}

const heightTaken = ({ frame, heightM }: { frame: number; heightM: number }) => ({
  frame,
  heightM: Math.fround(heightM),
});

/** Where to stay inside, a hole is where to stay outside. */
function fencesOf(area: FoundArea, use: AreaUse): ({ shape: 'polygon' } & Omit<FencePolygon, 'id'>)[] {
  if (use !== 'inside' && use !== 'outside') return [];
  const fence = { shape: 'polygon', group: 0, frame: 0 } as const;
  const { corners } = cleanOutline(area.corners);
  const holes = area.holes.map((hole) => cleanOutline(hole).corners);
  const outer = { ...fence, inclusion: use === 'inside', corners };
  return use === 'outside' ? [outer] : [outer, ...holes.map((hole) => ({ ...fence, inclusion: false, corners: hole }))];
}

/** The outline to survey once the plan is open. */
export const areaToSurvey = (read: ReadFile, choices: Choices): FoundArea | null =>
  read.areas[choices.areas.indexOf('survey')] ?? null;

/** Whether anything of the file is taken. */
export function takesSomething(read: ReadFile, choices: Choices): boolean {
  const { items, fence, rally } = chosenPlan(read, choices);
  const hasParts = items.length + fence.shapes.length + rally.length > 0 || fence.returnPoint !== null;
  return hasParts || areaToSurvey(read, choices) !== null;
}

/** Why it cannot be opened so; empty if it can. */
export function tooMuch(read: ReadFile, choices: Choices): string {
  const { items, rally } = chosenPlan(read, choices);
  const most = Math.max(items.length, rally.length);
  return most <= MAX_ITEMS
    ? ''
    : t('These are {count} places; a drone takes {maxItems} at most.', { count: most, maxItems: MAX_ITEMS });
}

const placesCounted = (n: number): string => plural(n, { one: '{n} place', other: '{n} places' });

export function assumedWords(read: ReadFile, choices: Choices): string[] {
  const { way, rally } = placesTaken(read, choices);
  const taken = [...way, ...rally];
  const unknown = taken.filter((place) => heightOf(place, choices.heights) === null);
  const unused = unknown.filter(({ heightM }) => heightM !== null).length;
  const { heightM, frame } = read.plan.defaults;
  const surveyed = areaToSurvey(read, choices);
  const holes = read.areas.reduce(
    (sum, area, at) => (choices.areas[at] === 'outside' || area === surveyed ? sum + area.holes.length : sum),
    0,
  );
  const doubled = read.areas.reduce((sum, { corners }, at) => {
    const isTaken = choices.areas[at] !== 'leave';
    return isTaken ? sum + cleanOutline(corners).doubled : sum;
  }, 0);
  return [
    ...(read.assumed ?? []),
    ...(unknown.length > 0
      ? [
          t('{counted} at {height} m {from}: the height of new items in this plan.', {
            counted: placesCounted(unknown.length),
            height: shortFloat(heightM),
            from: frameWords(frame),
          }),
        ]
      : []),
    ...(unused > 0
      ? [t('The heights of {counted} in the file are not used.', { counted: placesCounted(unused) })]
      : []),
    ...(choices.routes.size > 1
      ? [t('{n} routes are flown one after the other, as one.', { n: choices.routes.size })]
      : []),
    ...(doubled > 0 ? [t('Corners of outlines that are drawn twice count once: {doubled}.', { doubled })] : []),
    ...(holes > 0
      ? [
          t('{counted} in outlines: not left out of what is surveyed or forbidden.', {
            counted: plural(holes, { one: '{n} hole', other: '{n} holes' }),
          }),
        ]
      : []),
  ];
}

export function leftWords(read: ReadFile, choices: Choices): string[] {
  const [routes, marks] = [routesOf(read).length - choices.routes.size, marksOf(read).length];
  const areas = choices.areas.filter((use) => use === 'leave').length;
  return [
    ...read.dropped,
    ...(routes > 0 ? [plural(routes, { one: '{n} route', other: '{n} routes' })] : []),
    ...(marks > 0 && choices.marks === 'leave' ? [plural(marks, { one: '{n} mark', other: '{n} marks' })] : []),
    ...(areas > 0 ? [plural(areas, { one: '{n} outline', other: '{n} outlines' })] : []),
  ];
}
