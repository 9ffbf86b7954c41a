/** How far a flying squad mission is, and how long it still takes: by the estimates of its plans. Pure. */

import { distanceM } from '../plan/ground';
import type { Spot } from '../plan/plan_types';
import type { TimedPath, TimedPiece } from '../plan/timed_path';

export interface PartFacts {
  readonly path: TimedPath;
  /** The item to which it flies; null: not reported. */
  readonly current: number | null;
  readonly here: Spot | null;
  /** It flies the mission, paused or not. */
  readonly isFlown: boolean;
  /** The last item was reached, or it has landed after it. */
  readonly isDone: boolean;
}

export interface PartProgress {
  /** 0 to 1. */
  readonly share: number;
  readonly leftS: number;
}

/** How much of a leg lies behind a drone that is here. */
function shareOf({ from, to }: TimedPiece, here: Spot | null): number {
  const lengthM = distanceM(from, to);
  if (here === null || lengthM < 1) return 0;
  return Math.min(1, Math.max(0, 1 - distanceM(here, to) / lengthM));
}

/** Null: it does not fly its mission, or has not said where in it it is. */
export function partProgress({ path, current, here, isFlown, isDone }: PartFacts): PartProgress | null {
  if (isDone) return { share: 1, leftS: 0 };
  if (!isFlown || current === null || path.seconds <= 0) return null;
  const ofItem = path.pieces.filter(({ seq }) => seq === current);
  const [leg] = ofItem;
  const next = path.pieces.find(({ seq }) => seq > current);
  const beginsS = leg?.fromS ?? next?.fromS ?? path.seconds;
  const flownS = leg ? shareOf(leg, here) * (leg.toS - leg.fromS) : 0;
  const spentS = Math.min(path.seconds, beginsS + flownS);
  return { share: spentS / path.seconds, leftS: path.seconds - spentS };
}

export interface SquadProgress extends PartProgress {
  readonly flying: number;
}

/** Of all parts: the share of their time together, and the time until the last ends. Null: none flies. */
export function squadProgress(
  parts: readonly { readonly seconds: number; readonly progress: PartProgress | null }[],
): SquadProgress | null {
  const flying = parts.filter(({ progress }) => progress !== null && progress.leftS > 0).length;
  if (!parts.some(({ progress }) => progress !== null)) return null;
  const total = parts.reduce((sum, { seconds }) => sum + seconds, 0);
  const spent = parts.reduce((sum, { seconds, progress }) => sum + (progress?.share ?? 0) * seconds, 0);
  const leftS = Math.max(...parts.map(({ seconds, progress }) => progress?.leftS ?? seconds));
  return { share: total > 0 ? spent / total : 0, leftS, flying };
}
