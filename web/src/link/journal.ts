/** What was said about one drone, in the order it happened: by its autopilot, by the tower, and our own actions. */

import { Store, type Readable } from './store';

/** Old entries go first: the newest explain what the drone does now. */
export const JOURNAL_LIMIT = 200;

export type Source = 'autopilot' | 'tower' | 'command';
export type Severity = 'error' | 'warning' | 'info';

export interface Entry {
  readonly key: string;
  readonly atMs: number;
  readonly droneId: number | null;
  readonly source: Source;
  readonly severity: Severity;
  readonly text: string;
}

export class Journal {
  readonly #entries = new Store<readonly Entry[]>([]);

  get entries(): Readable<readonly Entry[]> {
    return this.#entries;
  }

  /** An entry with a key that is there already replaces it, in its place. */
  add(entry: Entry): void {
    const entries = this.#entries.get();
    const at = entries.findLastIndex((one) => one.key === entry.key);
    if (at >= 0) this.#entries.set(entries.with(at, entry));
    else this.#entries.set([...entries, entry].slice(-JOURNAL_LIMIT));
  }

  clear(): void {
    this.#entries.set([]);
  }
}

/** MAV_SEVERITY 0..7 in three steps: what must be seen, what should be, the rest. */
export function severityOf(mavSeverity: number): Severity {
  if (mavSeverity <= 3) return 'error';
  return mavSeverity === 4 ? 'warning' : 'info';
}
