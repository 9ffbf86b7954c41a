/**
 * The drawing and settings of a survey, a corridor or a circle, and the resulting items: recomputed with each change,
 * as a preview.
 */

import { t } from '../../languages/text';
import { FAMILIES } from '../../link/generated/autopilots.gen';
import { flownPath } from '../flown_path';
import { distanceM } from '../ground';
import { cleanLine, cleanOutline } from '../outline';
import { EMPTY_PLAN, type Plan, type Spot, type WireItem } from '../plan_types';
import { CMD, specOf, type AutopilotKind } from '../catalogue';
import { planItems } from '../wire_items';
import { areaM2, SurveyFault } from './area';
import { distancesFor, footprint, type Camera } from './camera';
import { corridorItems, orbitItems } from './corridor';
import { followGround, type FollowSettings } from './follow_ground';
import { insideItems, outsideOf } from './inside_grid';
import { surveyItems } from './survey_grid';

export type Pattern = 'survey' | 'corridor' | 'orbit';

export interface CameraChoice {
  readonly key: string;
  readonly label: string;
  /** Null: the user types the distances. */
  readonly camera: Camera | null;
}

const camera = (width: number, height: number, focal: number, widthPx: number, heightPx: number): Camera => ({
  sensorWidthMm: width,
  sensorHeightMm: height,
  focalMm: focal,
  widthPx,
  heightPx,
  isAcross: true,
});

/** Sensor sizes, focal lengths and pictures as the makers specify them. */
export const CAMERAS: readonly CameraChoice[] = [
  { key: 'none', label: t('No camera, or typed distances'), camera: null },
  { key: 'a6000-16', label: t('Sony α6000, 16 mm'), camera: camera(23.5, 15.6, 16, 6000, 4000) },
  { key: 'a7r-35', label: t('Sony α7R, 35 mm'), camera: camera(35.9, 24, 35, 7360, 4912) },
  { key: 'p1-35', label: t('DJI Zenmuse P1, 35 mm'), camera: camera(35.9, 24, 35, 8192, 5460) },
  { key: 'p4p', label: t('DJI Phantom 4 Pro'), camera: camera(13.2, 8.8, 8.8, 5472, 3648) },
  { key: 's100', label: t('Canon S100, wide'), camera: camera(7.44, 5.58, 5.2, 4000, 3000) },
  { key: 'pi-hq-6', label: t('Raspberry Pi HQ, 6 mm'), camera: camera(6.287, 4.712, 6, 4056, 3040) },
  { key: 'own', label: t('Another camera'), camera: camera(13.2, 8.8, 8.8, 5472, 3648) },
];

export interface PatternSettings {
  readonly camera: string;
  readonly own: Camera;
  readonly heightM: number;
  readonly frontOverlap: number;
  readonly sideOverlap: number;
  readonly spacingM: number;
  /** 0: no pictures. */
  readonly triggerM: number;
  readonly angleDeg: number;
  readonly turnaroundM: number;
  /** A survey leaves its area nowhere. */
  readonly staysInside: boolean;
  readonly entry: 0 | 1 | 2 | 3;
  readonly isAcross: boolean;
  readonly widthM: number;
  readonly fromEnd: boolean;
  readonly turns: number;
  readonly points: number;
  readonly isClockwise: boolean;
  readonly looksAtMiddle: boolean;
  readonly lookAtM: number;
  /** The height is above the ground everywhere, within the tolerance, instead of above home. */
  readonly overGround: boolean;
  readonly toleranceM: number;
}

export const USUAL_SETTINGS: PatternSettings = {
  camera: 'a6000-16',
  own: CAMERAS.at(-1)!.camera!,
  heightM: 50,
  frontOverlap: 75,
  sideOverlap: 70,
  spacingM: 25,
  triggerM: 0,
  angleDeg: 0,
  turnaroundM: 10,
  staysInside: false,
  entry: 0,
  isAcross: true,
  widthM: 60,
  fromEnd: false,
  turns: 1,
  points: 12,
  isClockwise: true,
  looksAtMiddle: true,
  lookAtM: 0,
  overGround: false,
  toleranceM: 2,
};

/** For heights above the ground. */
export type Land = Pick<FollowSettings, 'home' | 'ground'>;

export interface Preview {
  readonly items: readonly WireItem[];
  /** Why there is no result, for people. */
  readonly fault: string;
  /** Corners that were drawn twice and count once. */
  readonly doubled: number;
  readonly spacingM: number;
  readonly triggerM: number | null;
  readonly pixelCm: number | null;
  readonly areaM2: number;
  readonly lengthM: number;
  /** Of a survey: how much of its way leaves the area, turns too. */
  readonly outsideM: number;
  readonly outside: readonly (readonly [Spot, Spot])[];
  readonly pictures: number;
}

export const cameraOf = (settings: PatternSettings): Camera | null => {
  const choice = CAMERAS.find(({ key }) => key === settings.camera);
  const chosen = settings.camera === 'own' ? settings.own : (choice?.camera ?? null);
  return chosen && { ...chosen, isAcross: settings.isAcross };
};

const NONE: Preview = {
  items: [],
  fault: '',
  doubled: 0,
  spacingM: 0,
  triggerM: null,
  pixelCm: null,
  areaM2: 0,
  lengthM: 0,
  outsideM: 0,
  outside: [],
  pictures: 0,
};

/** `frame`: the height reference of the plan. Never throws for anything that can be drawn or set. */
export function patternPreview(
  pattern: Pattern,
  drawn: readonly Spot[],
  radiusM: number,
  settings: PatternSettings,
  frame: number,
  autopilot: AutopilotKind,
  land: Land | null = null,
): Preview {
  const { heightM, angleDeg, turnaroundM, entry } = settings;
  try {
    if (pattern === 'orbit') {
      const [centre] = drawn;
      if (!centre) return NONE;
      const { turns, points, isClockwise, looksAtMiddle, lookAtM } = settings;
      const look = looksAtMiddle ? lookAtM : null;
      const items = orbitItems(centre, {
        radiusM,
        heightM,
        frame,
        turns,
        points,
        isClockwise,
        fromDeg: angleDeg,
        lookAtM: look,
        looksByLegacyRoi: FAMILIES[autopilot].looksByLegacyRoi,
      });
      return { ...NONE, items, lengthM: lengthOf(items), areaM2: Math.PI * radiusM ** 2 };
    }
    const seen = cameraOf(settings);
    const print = seen && footprint(seen, heightM);
    const distances = print
      ? distancesFor(print, settings.frontOverlap, settings.sideOverlap)
      : { spacingM: settings.spacingM, triggerM: settings.triggerM };
    const triggerM = distances.triggerM > 0 ? distances.triggerM : null;
    const { spacingM } = distances;
    const flown = { heightM, frame, triggerM, spacingM };
    const flat =
      pattern === 'survey'
        ? (settings.staysInside ? insideItems : surveyItems)(drawn, { ...flown, angleDeg, turnaroundM, entry })
        : corridorItems(drawn, { ...flown, widthM: settings.widthM, fromEnd: settings.fromEnd });
    const items =
      settings.overGround && land ? followGround(flat, { heightM, toleranceM: settings.toleranceM, ...land }) : flat;
    const size = pattern === 'survey' ? areaM2(drawn) : along(drawn) * settings.widthM;
    const pictures = triggerM === null ? 0 : picturesOf(items);
    const left = pattern === 'survey' ? outsideOf(cleanOutline(drawn).corners, wayOf(items)) : null;
    return {
      ...NONE,
      items,
      doubled: (pattern === 'survey' ? cleanOutline(drawn) : cleanLine(drawn)).doubled,
      spacingM,
      triggerM,
      pixelCm: print?.pixelCm ?? null,
      areaM2: size,
      lengthM: lengthOf(items),
      outsideM: left?.lengthM ?? 0,
      outside: left?.parts ?? [],
      pictures,
    };
  } catch (error) {
    if (error instanceof SurveyFault) return { ...NONE, fault: error.message };
    throw error;
  }
}

const along = (line: readonly Spot[]): number =>
  line.slice(1).reduce((sum, spot, at) => sum + distanceM(line[at]!, spot), 0);

/** From its first place to its last. */
const lengthOf = (items: readonly WireItem[]): number => along(wayOf(items));

const wayOf = (items: readonly WireItem[]): Spot[] =>
  items.filter((item) => specOf(item.command)?.flies).map(({ x, y }) => ({ latE7: x, lonE7: y }));

function picturesOf(items: readonly WireItem[]): number {
  const plan: Plan = { ...EMPTY_PLAN, items: planItems(items, 1) };
  let everyM = 0;
  let count = 0;
  const { legs, order } = flownPath(plan);
  const bySeq = new Map(legs.map((leg) => [leg.seq, leg]));
  for (const seq of order.steps) {
    const item = items[seq]!;
    if (item.command === CMD.TRIGGER_DISTANCE) everyM = Math.max(0, item.params[0] ?? 0);
    const leg = bySeq.get(seq);
    if (leg && everyM > 0) count += Math.floor(leg.lengthM / everyM) + 1;
  }
  return count;
}

/** Along the longest side: the fewest turns. For an area, clockwise from north, 0 to 180. */
export function longestSideDeg(area: readonly Spot[], bearing: (from: Spot, to: Spot) => number): number {
  let [longest, angle] = [0, 0];
  for (const [at, corner] of area.entries()) {
    const next = area[(at + 1) % area.length]!;
    const length = distanceM(corner, next);
    if (length > longest) [longest, angle] = [length, bearing(corner, next)];
  }
  return Math.round(((angle % 180) + 180) % 180);
}
