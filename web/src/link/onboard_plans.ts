/** The items of the plans on board a drone, read once for each plan that its agent reports. */

import { t } from '../languages/text';
import type { PlanRead, Row } from './mission_rest';
import { PLAN_KINDS, type PlanKind, type PlanOnBoard } from './operation_types';
import { Store, type Readable } from './store';

/** By kind. Omits a plan that is being read, that failed to read, or that is unknown. */
export type OnboardRows = Readonly<Partial<Record<PlanKind, readonly Row[]>>>;

type ReportedPlans = Readonly<Partial<Record<PlanKind, PlanOnBoard>>>;

export class OnboardPlans {
  readonly #read: (kind: PlanKind) => Promise<PlanRead>;
  readonly #rows = new Store<OnboardRows>({});
  readonly #problem = new Store('');
  /** The reported hash last requested; null: unknown. */
  readonly #wanted = new Map<PlanKind, string | null>();

  constructor(read: (kind: PlanKind) => Promise<PlanRead>) {
    this.#read = read;
  }

  get rows(): Readable<OnboardRows> {
    return this.#rows;
  }

  /** Why a plan on board could not be read; empty if all were. */
  get problem(): Readable<string> {
    return this.#problem;
  }

  /** Takes the agent's current report. A failed read is retried when anything changes. */
  update(plans: ReportedPlans): void {
    for (const kind of PLAN_KINDS) {
      const hash = plans[kind]?.hash ?? null;
      if (this.#wanted.get(kind) === hash) continue;
      this.#wanted.set(kind, hash);
      // The old plan is no longer on board, whatever the read returns.
      this.#put(kind, undefined);
      if (hash !== null) void this.#fetch(kind, hash);
    }
  }

  async #fetch(kind: PlanKind, hash: string): Promise<void> {
    try {
      const read = await this.#read(kind);
      if (this.#wanted.get(kind) !== hash) return;
      // Replaced meanwhile: the agent reports that too, and a new read follows.
      if (read.hash !== hash || read.items === null) return;
      this.#put(kind, read.items);
      this.#problem.set('');
    } catch (error) {
      if (this.#wanted.get(kind) !== hash) return;
      this.#wanted.delete(kind);
      const why = error instanceof Error ? error.message : String(error);
      this.#problem.set(t('The {names} on board could not be read: {why}', { names: NAMES[kind], why }));
    }
  }

  #put(kind: PlanKind, rows: readonly Row[] | undefined): void {
    if (rows === undefined && this.#rows.get()[kind] === undefined) return;
    const { [kind]: before, ...others } = this.#rows.get();
    void before;
    this.#rows.set(rows === undefined ? others : { ...others, [kind]: rows });
  }
}

const NAMES: Record<PlanKind, string> = { mission: t('mission'), fence: t('fence'), rally: t('rally points') };
