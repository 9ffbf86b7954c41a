/** Hours, shares and maintenance in words. */

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
  if (state === 'due') return left_h < 0 ? `Overdue by ${hoursWords(-left_h)}` : 'Due now';
  return `${hoursWords(left_h)} left`;
}

/** `3 holds, 1 link loss`; empty if nothing happened. */
export function incidentWords(counts: {
  readonly holds: number;
  readonly link_losses: number;
  readonly critical_alerts: number;
}): string {
  const some = (count: number, one: string, many: string): string =>
    count === 0 ? '' : `${count} ${count === 1 ? one : many}`;
  return [
    some(counts.holds, 'hold', 'holds'),
    some(counts.link_losses, 'link loss', 'link losses'),
    some(counts.critical_alerts, 'critical alert', 'critical alerts'),
  ]
    .filter(Boolean)
    .join(', ');
}
