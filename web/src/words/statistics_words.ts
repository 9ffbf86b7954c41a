/** Hours, shares and maintenance in words. */

import { plural, t } from '../languages/text';
import type { MaintenanceTask } from '../link/statistics';
import { UNKNOWN } from './format';

/** `0 min`, `48 min`, `12 h 05 min`. */
export function hoursWords(hours: number | null): string {
  if (hours === null) return UNKNOWN;
  const minutes = Math.round(hours * 60);
  const rest = minutes % 60;
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${String(rest).padStart(2, '0')} min`;
}

/** What of the interval is left, or by how much it is over. */
export function taskWords({ state, left_h }: MaintenanceTask): string {
  if (state === 'due') return left_h < 0 ? t('Overdue by {hours}', { hours: hoursWords(-left_h) }) : t('Due now');
  return t('{hours} left', { hours: hoursWords(left_h) });
}

/** `3 holds, 1 link loss`; empty if nothing happened. */
export function incidentWords(counts: {
  readonly holds: number;
  readonly link_losses: number;
  readonly critical_alerts: number;
}): string {
  const { holds, link_losses: losses, critical_alerts: alerts } = counts;
  return [
    holds && plural(holds, { one: '{n} hold', other: '{n} holds' }),
    losses && plural(losses, { one: '{n} link loss', other: '{n} link losses' }),
    alerts && plural(alerts, { one: '{n} critical alert', other: '{n} critical alerts' }),
  ]
    .filter(Boolean)
    .join(', ');
}
