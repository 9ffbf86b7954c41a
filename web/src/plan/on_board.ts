/** The plan on the screen against the one that a drone has, of each kind: by hash, so that it needs no download. */

import { planHash } from './plan_hash';
import type { Plan, PlanKind } from './plan_types';
import { itemsOf } from './wire_items';

/** What the drone's agent tells; undefined where it never has. */
export interface OnboardPlan {
  readonly hash: string | null;
  /** What was sent, where the autopilot keeps some fields in its own way. */
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
  /** On the drone; null: nobody knows. */
  readonly there: number | null;
  /** False: half a plan may be on board. */
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

/** What an upload sends unless somebody chooses: what is here and not there. What is empty here is taken off by choice only. */
export const toSend = (states: readonly KindState[]): PlanKind[] =>
  states.filter(({ standing, here }) => standing !== 'on the drone' && here > 0).map(({ kind }) => kind);

/** Of these, what lies under them on the drone, or may. */
export const overwritten = (states: readonly KindState[], kinds: readonly PlanKind[]): KindState[] =>
  states.filter(({ kind, standing, there }) => kinds.includes(kind) && standing !== 'on the drone' && there !== 0);
