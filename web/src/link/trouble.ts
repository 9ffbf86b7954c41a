/**
 * What is wrong with a drone, for every place that shows one: list, row, card, map and flight bar. One drone has one
 * trouble: the most urgent of its alerts, which the tower decides. Pure.
 */

import type { Alert } from './alerts';

export interface Trouble {
  /** The name of the rule. */
  readonly kind: string;
  readonly severity: 'critical' | 'warning';
  /** A few words for a row. */
  readonly badge: string;
  /** Smaller is worse. */
  readonly rank: number;
  readonly alert: Alert;
}

/** The rules that other parts of a row or card tell of already, with a countdown or a button. */
const TOLD_OTHERWISE: ReadonlySet<string> = new Set(['unattended', 'lost-action-counting', 'lost-action']);

/** `alerts`: the open ones of a drone, the most urgent first. */
export function troubleOf(alerts: readonly Alert[]): Trouble | null {
  const alert = alerts.find(({ severity }) => severity !== 'notice');
  if (alert === undefined || alert.severity === 'notice') return null;
  const { rule: kind, severity, badge, rank } = alert;
  return { kind, severity, badge, rank, alert };
}

export const isToldOtherwise = ({ kind }: Trouble): boolean => TOLD_OTHERWISE.has(kind);
