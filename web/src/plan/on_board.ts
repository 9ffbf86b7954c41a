/** Compares the plan on the screen with the drone's, for each kind: by hash, so that it needs no download. */

import { planHash } from './plan_hash';
import type { Plan, PlanKind } from './plan_types';
import { itemsOf } from './wire_items';

/** As the drone's agent reports; undefined if it never did. */
export interface OnboardPlan {
  readonly hash: string | null;
  /** The hash of what was sent, if the autopilot stores some fields differently. */
  readonly sent_hash: string | null;
  readonly count: number;
  readonly fit_to_fly: boolean;
}

export type Standing = 'on the drone' | 'changed' | 'unknown';

export interface KindState {
  readonly kind: PlanKind;
  readonly standing: Standing;
  /** On the screen. */
  readonly here: number;
  /** On the drone; null: unknown. */
  readonly there: number | null;
  /** False: an incomplete plan may be on board. */
  readonly isFit: boolean;
}

export const PLAN_KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];

export function kindState(plan: Plan, kind: PlanKind, onboard: OnboardPlan | undefined): KindState {
  const items = itemsOf(plan, kind);
  const isKnown = onboard !== undefined && onboard.hash !== null;
  const state = { kind, here: items.length, there: isKnown ? onboard.count : null, isFit: onboard?.fit_to_fly ?? true };
  if (!isKnown) return { ...state, standing: 'unknown' };
  const hash = planHash(kind, items);
  const isThere = hash === onboard.hash || hash === onboard.sent_hash || (items.length === 0 && onboard.count === 0);
  return { ...state, standing: isThere ? 'on the drone' : 'changed' };
}

export const kindStates = (plan: Plan, onboard: Readonly<Partial<Record<PlanKind, OnboardPlan>>>): KindState[] =>
  PLAN_KINDS.map((kind) => kindState(plan, kind, onboard[kind]));

/**
 * The default selection of an upload: kinds that exist here and differ on board. Clearing a kind on board is the user's
 * explicit choice.
 */
export const toSend = (states: readonly KindState[]): PlanKind[] =>
  states.filter(({ standing, here }) => standing !== 'on the drone' && here > 0).map(({ kind }) => kind);

/** Those of these kinds whose plan on the drone is overwritten, or may be. */
export const overwritten = (states: readonly KindState[], kinds: readonly PlanKind[]): KindState[] =>
  states.filter(({ kind, standing, there }) => kinds.includes(kind) && standing !== 'on the drone' && there !== 0);
