/** The journal of one drone in order of time: statements of its autopilot and of the tower, and our own actions. */

import { Store, type Readable } from './store';

/** Old entries are dropped first: the newest explain what the drone does now. */
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

  /** An entry with an existing key replaces the old one in its place. */
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

export interface FoldedEntry {
  /** The newest of them. */
  readonly entry: Entry;
  readonly count: number;
}

/** Repeats of one line are one line, where the newest of them stands. */
export function foldedEntries(entries: readonly Entry[]): FoldedEntry[] {
  const folded = new Map<string, FoldedEntry>();
  for (const entry of entries) {
    const line = [entry.droneId, entry.source, entry.severity, entry.text].join('|');
    const count = (folded.get(line)?.count ?? 0) + 1;
    folded.delete(line); // a map keeps the order in which its keys came
    folded.set(line, { entry, count });
  }
  return [...folded.values()];
}

/** MAV_SEVERITY 0..7 in three levels: critical, warning, everything else. */
export function severityOf(mavSeverity: number): Severity {
  if (mavSeverity <= 3) return 'error';
  return mavSeverity === 4 ? 'warning' : 'info';
}
