/** The ground under a plan: heights of its path above it, and the legs and ways home that come too near. Pure. */

import { t } from '../languages/text';
import { CMD, commandWords } from './catalogue';
import type { FlownPath, GroundAt, Leg } from './flown_path';
import { distanceM } from './ground';
import type { Finding } from './plan_checks';
import { latDegOf, lonDegOf, spotOf, type Plan, type Spot } from './plan_types';

/** Between two looks at the ground. */
export const STEP_M = 10;
/** Of a whole plan: a longer one is looked at in wider steps. */
const MAX_LOOKS = 20_000;
/** Shorter legs climb or descend where they are. */
const ON_THE_SPOT_M = 1;
/** After these nobody returns. */
const ENDS: ReadonlySet<number> = new Set([CMD.LAND, CMD.VTOL_LAND, CMD.RETURN]);

export function between(from: Spot, to: Spot, share: number): Spot {
  const east = ((((lonDegOf(to) - lonDegOf(from) + 180) % 360) + 360) % 360) - 180;
  const lon = ((((lonDegOf(from) + east * share + 180) % 360) + 360) % 360) - 180;
  return spotOf(latDegOf(from) + (latDegOf(to) - latDegOf(from)) * share, lon);
}

export interface GroundLimits {
  /** The least height above the ground. */
  readonly clearanceM: number;
  /** Above home; null: not known. */
  readonly returnHeightM: number | null;
}

interface Way {
  readonly from: Spot;
  readonly to: Spot;
  readonly fromHeightM: number;
  readonly toHeightM: number;
  readonly lengthM: number;
}

interface Lowest {
  readonly gapM: number;
  /** The ground was not known everywhere. */
  readonly isPartly: boolean;
}

/** Heights are above home, whose ground is `homeM` above the sea. */
function lowestOn(way: Way, homeM: number, ground: GroundAt, stepM: number): Lowest {
  const parts = Math.max(1, Math.ceil(way.lengthM / stepM));
  let gapM = Infinity;
  let isPartly = false;
  for (let part = 0; part <= parts; part += 1) {
    const share = part / parts;
    const under = ground(between(way.from, way.to, share));
    if (under === null || under === undefined) isPartly = true;
    else gapM = Math.min(gapM, way.fromHeightM + (way.toHeightM - way.fromHeightM) * share - (under - homeM));
  }
  return { gapM, isPartly };
}

const stepOf = (legs: readonly Leg[]): number =>
  Math.max(STEP_M, legs.reduce((sum, { lengthM }) => sum + lengthM, 0) / MAX_LOOKS);

const whereWords = (gapM: number): string =>
  gapM < 0
    ? t('{gap} m below the ground', { gap: Math.round(-gapM) })
    : t('only {gap} m above the ground', { gap: Math.round(gapM) });

/** Nothing without elevation or a home. `ground` answers undefined while it is loading. */
export function groundFindings(plan: Plan, path: FlownPath, ground: GroundAt, limits: GroundLimits): Finding[] {
  const { home, items } = plan;
  const homeM = home && ground(home.spot);
  if (!home || homeM === null || homeM === undefined) return [];
  const { clearanceM, returnHeightM } = limits;
  const stepM = stepOf(path.legs);
  const findings: Finding[] = [];
  const found = new Set<number>();
  let isPartly = false;
  let worstHome: { seq: number; gapM: number } | null = null;
  for (const leg of path.legs) {
    const { seq } = leg;
    const isOnTheSpot = leg.lengthM < ON_THE_SPOT_M;
    const least = leg.followsGround || isOnTheSpot ? null : lowestOn(leg, homeM, ground, stepM);
    isPartly ||= least?.isPartly ?? false;
    if (least && least.gapM < clearanceM && !found.has(seq)) {
      found.add(seq);
      const name = t('item {seq} ({command})', { seq: seq + 1, command: commandWords(items[seq]!.command) });
      const words = t('The way to {name} is {where}; {clearance} m is the least.', {
        name,
        where: whereWords(least.gapM),
        clearance: clearanceM,
      });
      findings.push({ severity: 'error', kind: 'mission', part: items[seq]!.id, words });
    }
    if (returnHeightM === null || ENDS.has(items[seq]!.command)) continue;
    const heightM = Math.max(returnHeightM, leg.toHeightM);
    const back = { from: leg.to, to: home.spot, fromHeightM: heightM, toHeightM: heightM };
    const { gapM } = lowestOn({ ...back, lengthM: distanceM(leg.to, home.spot) }, homeM, ground, stepM * 2);
    if (gapM < clearanceM && gapM < (worstHome?.gapM ?? Infinity)) worstHome = { seq, gapM };
  }
  if (worstHome) {
    const words = t('A return from item {seq}, at the return height of {returnHeight} m, is {where}.', {
      seq: worstHome.seq + 1,
      returnHeight: Math.round(returnHeightM!),
      where: whereWords(worstHome.gapM),
    });
    findings.push({ severity: 'warning', kind: 'mission', part: items[worstHome.seq]!.id, words });
  }
  if (isPartly) {
    const words = t('The height of the ground is not known under all of the plan: there it is not checked.');
    findings.push({ severity: 'warning', kind: 'mission', part: null, words });
  }
  return findings;
}
