/**
 * What somebody must look at, until somebody has: one list for the whole squad. Conditions come and go (an alert is
 * over when its condition is), statements happen. Nothing critical leaves the list before it was acknowledged.
 */

import type { AlertSeverity, Condition } from './conditions';
import { Store, type Readable } from './store';

export interface Alert {
  readonly key: string;
  readonly droneId: number | null;
  readonly severity: AlertSeverity;
  readonly text: string;
  readonly beganMs: number;
  /** How often it was said. */
  readonly count: number;
  /** Of a condition: whether it still holds. */
  readonly isLasting: boolean;
  readonly acknowledgedMs: number | null;
}

/** Beyond this the acknowledged ones go first, then the oldest that are not critical, then the oldest. */
export const ALERT_LIMIT = 300;
/** The same words of the same drone again within this time are the same alert. */
export const REPEAT_MS = 60_000;

const RANK: Record<AlertSeverity, number> = { critical: 0, warning: 1, notice: 2 };

export class Alerts {
  readonly #list = new Store<readonly Alert[]>([]);
  /** The alert of each condition that holds: `drone/condition`, or a name of its own, to key. */
  readonly #lasting = new Map<string, string>();
  #made = 0;

  /** Oldest first. */
  get list(): Readable<readonly Alert[]> {
    return this.#list;
  }

  /** Something happened. Answers the key of its alert. */
  said(droneId: number | null, severity: AlertSeverity, text: string, nowMs: number): string {
    const same = this.#list
      .get()
      .findLast(
        (one) =>
          one.droneId === droneId &&
          one.text === text &&
          one.acknowledgedMs === null &&
          nowMs - one.beganMs < REPEAT_MS,
      );
    if (!same || same.isLasting) return this.#add(droneId, severity, text, nowMs, false);
    this.#change(same.key, { count: same.count + 1 });
    return same.key;
  }

  /** More of the same statement came. */
  reworded(key: string, text: string): void {
    this.#change(key, { text });
  }

  /** All conditions of one drone as they are now. */
  holds(droneId: number, conditions: readonly Condition[], nowMs: number): void {
    const prefix = `${droneId}/`;
    const now = new Set(conditions.map(({ id }) => prefix + id));
    for (const [name, key] of [...this.#lasting]) {
      if (!name.startsWith(prefix) || now.has(name)) continue;
      this.#lasting.delete(name);
      this.#change(key, { isLasting: false });
    }
    for (const { id, severity, text } of conditions) {
      if (this.#lasting.has(prefix + id)) continue;
      this.#lasting.set(prefix + id, this.#add(droneId, severity, text, nowMs, true));
    }
  }

  /** A condition with a name of its own, which need not be of one drone alone: it holds until it is `over`. */
  lasts(name: string, droneId: number, severity: AlertSeverity, text: string, nowMs: number): void {
    if (!this.#lasting.has(name)) this.#lasting.set(name, this.#add(droneId, severity, text, nowMs, true));
  }

  over(name: string): void {
    const key = this.#lasting.get(name);
    if (key === undefined) return;
    this.#lasting.delete(name);
    this.#change(key, { isLasting: false });
  }

  acknowledge(key: string, nowMs: number): void {
    this.#change(key, { acknowledgedMs: nowMs });
  }

  acknowledgeAll(nowMs: number): void {
    if (this.#list.get().every(({ acknowledgedMs }) => acknowledgedMs !== null)) return;
    this.#list.update((all) =>
      all.map((one) => (one.acknowledgedMs === null ? { ...one, acknowledgedMs: nowMs } : one)),
    );
  }

  clear(): void {
    this.#lasting.clear();
    this.#list.set([]);
  }

  #add(droneId: number | null, severity: AlertSeverity, text: string, nowMs: number, isLasting: boolean): string {
    const key = `alert-${++this.#made}`;
    const alert = { key, droneId, severity, text, beganMs: nowMs, count: 1, isLasting, acknowledgedMs: null };
    this.#list.update((all) => bounded([...all, alert]));
    return key;
  }

  #change(key: string, changes: Partial<Alert>): void {
    this.#list.update((all) => all.map((one) => (one.key === key ? { ...one, ...changes } : one)));
  }
}

function bounded(all: readonly Alert[]): readonly Alert[] {
  if (all.length <= ALERT_LIMIT) return all;
  const drop =
    all.find((one) => one.acknowledgedMs !== null && !one.isLasting) ??
    all.find((one) => one.severity !== 'critical' && !one.isLasting) ??
    all[0];
  return all.filter((one) => one !== drop);
}

export const isOpen = (alert: Alert): boolean => alert.acknowledgedMs === null;

/** Those not acknowledged before the others, the worst first, the newest first. */
export function byUrgency(all: readonly Alert[]): Alert[] {
  return [...all].sort(
    (a, b) =>
      Number(!isOpen(a)) - Number(!isOpen(b)) ||
      (isOpen(a) ? RANK[a.severity] - RANK[b.severity] : 0) ||
      b.beganMs - a.beganMs,
  );
}

/** The worst that nobody has acknowledged. */
export function worstOpen(all: readonly Alert[]): AlertSeverity | null {
  return byUrgency(all).find(isOpen)?.severity ?? null;
}
