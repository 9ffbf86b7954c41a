/**
 * Keeps unsaved work in the browser: it survives a reload, a crash, an empty battery. The caller passes storage and
 * plan.
 */

import { documentOf, planOfDocument, type PlanDocument } from './plan_document';
import type { Plan, Spot } from './plan_types';
import type { Pattern, PatternSettings } from './survey/patterns';

/** A survey whose items are in the plan, consecutive and unchanged. */
export interface KeptPattern {
  readonly pattern: Pattern;
  readonly drawn: readonly Spot[];
  readonly radiusM: number;
  readonly settings: PatternSettings;
  readonly from: number;
  readonly count: number;
}

export interface KeptPlan {
  readonly plan: Plan;
  readonly name: string;
  /** Its place in the tower's library, and the version it is based on. */
  readonly library: { readonly id: number; readonly version: number } | null;
  readonly isSaved: boolean;
  readonly patterns: readonly KeptPattern[];
}

interface Stored extends Omit<KeptPlan, 'plan'> {
  readonly format: 1;
  readonly document: PlanDocument;
}

type KeyStorage = Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>;

const keyOf = (userId: number): string => `tower.plan.${userId}`;

/** Returns false if the browser does not store it: full, or forbidden. */
export function keepPlan(storage: KeyStorage, userId: number, kept: KeptPlan): boolean {
  const { plan, ...rest } = kept;
  const stored: Stored = { format: 1, ...rest, document: documentOf(plan) };
  try {
    storage.setItem(keyOf(userId), JSON.stringify(stored));
    return true;
  } catch {
    return false;
  }
}

/** Null if there is none, or an unreadable one. */
export function keptPlan(storage: KeyStorage, userId: number): KeptPlan | null {
  try {
    const stored = JSON.parse(storage.getItem(keyOf(userId)) ?? 'null') as Partial<Stored> | null;
    if (!stored || stored.format !== 1) return null;
    const { plan } = planOfDocument(stored.document);
    const { name, library, isSaved, patterns } = stored;
    return {
      plan,
      name: typeof name === 'string' ? name : '',
      library: library && Number.isInteger(library.id) && Number.isInteger(library.version) ? library : null,
      isSaved: isSaved === true,
      patterns: Array.isArray(patterns) ? patterns : [],
    };
  } catch {
    return null;
  }
}
