/**
 * What needs a user's attention, for the whole squad. An alert of a condition ends with the condition; a statement is
 * an event. Critical alerts stay in the list until they are acknowledged.
 */

import type { AlertSeverity, Condition } from './conditions';
import { Store, type Readable } from './store';

export interface Alert {
  readonly key: string;
  readonly droneId: number | null;
  readonly severity: AlertSeverity;
  readonly text: string;
  readonly beganMs: number;
  /** How often it occurred. */
  readonly count: number;
  /** For a condition: whether it still holds. */
  readonly isLasting: boolean;
  readonly acknowledgedMs: number | null;
}

/** Above this limit, drops acknowledged alerts first, then the oldest that are not critical, then the oldest. */
export const ALERT_LIMIT = 300;
/** The same text of the same drone within this time is the same alert. */
export const REPEAT_MS = 60_000;

const RANK: Record<AlertSeverity, number> = { critical: 0, warning: 1, notice: 2 };

export class Alerts {
  readonly #list = new Store<readonly Alert[]>([]);
  /** Alert key of each active condition, by `drone/condition` or by its own name. */
  readonly #lasting = new Map<string, string>();
  #made = 0;

  /** Oldest first. */
  get list(): Readable<readonly Alert[]> {
    return this.#list;
  }

  /** Adds a statement. Returns the key of its alert. */
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

  /** Another part of the same statement arrived. */
  reworded(key: string, text: string): void {
    this.#change(key, { text });
  }

  /** All current conditions of one drone. */
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

  /** A condition with its own name, which may concern several drones: it lasts until `over`. */
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

/** Unacknowledged before acknowledged, then the worst first, then the newest first. */
export function byUrgency(all: readonly Alert[]): Alert[] {
  return [...all].sort(
    (a, b) =>
      Number(!isOpen(a)) - Number(!isOpen(b)) ||
      (isOpen(a) ? RANK[a.severity] - RANK[b.severity] : 0) ||
      b.beganMs - a.beganMs,
  );
}

/** The worst severity not acknowledged. */
export function worstOpen(all: readonly Alert[]): AlertSeverity | null {
  return byUrgency(all).find(isOpen)?.severity ?? null;
}
