/** The items of the plans that a drone has on board, read once for each that its agent tells of. */

import type { PlanRead, Row } from './mission_rest';
import { PLAN_KINDS, type PlanKind, type PlanOnBoard } from './operation_types';
import { Store, type Readable } from './store';

/** Of each kind that is known; nothing of what is being read, cannot be read, or is not known on the drone. */
export type BoardRows = Readonly<Partial<Record<PlanKind, readonly Row[]>>>;

type ReportedPlans = Readonly<Partial<Record<PlanKind, PlanOnBoard>>>;

export class OnboardPlans {
  readonly #read: (kind: PlanKind) => Promise<PlanRead>;
  readonly #rows = new Store<BoardRows>({});
  readonly #problem = new Store('');
  /** What was last asked for: the hash that was told; null: not known. */
  readonly #wanted = new Map<PlanKind, string | null>();

  constructor(read: (kind: PlanKind) => Promise<PlanRead>) {
    this.#read = read;
  }

  get rows(): Readable<BoardRows> {
    return this.#rows;
  }

  /** Why a plan that is on board could not be read; empty when all could. */
  get problem(): Readable<string> {
    return this.#problem;
  }

  /** What the agent tells now. What failed to be read is tried again when anything changes. */
  update(plans: ReportedPlans): void {
    for (const kind of PLAN_KINDS) {
      const hash = plans[kind]?.hash ?? null;
      if (this.#wanted.get(kind) === hash) continue;
      this.#wanted.set(kind, hash);
      // What was there is not there any more, whatever comes of reading the new one.
      this.#put(kind, undefined);
      if (hash !== null) void this.#fetch(kind, hash);
    }
  }

  async #fetch(kind: PlanKind, hash: string): Promise<void> {
    try {
      const read = await this.#read(kind);
      if (this.#wanted.get(kind) !== hash) return;
      // Another one by now: that is told as well, and read then.
      if (read.hash !== hash || read.items === null) return;
      this.#put(kind, read.items);
      this.#problem.set('');
    } catch (error) {
      if (this.#wanted.get(kind) !== hash) return;
      this.#wanted.delete(kind);
      const why = error instanceof Error ? error.message : String(error);
      this.#problem.set(`The ${NAMES[kind]} on board could not be read: ${why}`);
    }
  }

  #put(kind: PlanKind, rows: readonly Row[] | undefined): void {
    if (rows === undefined && this.#rows.get()[kind] === undefined) return;
    const { [kind]: before, ...others } = this.#rows.get();
    void before;
    this.#rows.set(rows === undefined ? others : { ...others, [kind]: rows });
  }
}

const NAMES: Record<PlanKind, string> = { mission: 'mission', fence: 'fence', rally: 'rally points' };
