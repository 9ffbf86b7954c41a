/** Sums of recorded flights, one's own log book, and maintenance by hours. Access is that of the flights. */

import type { Rest } from './rest';
import type { Schemas } from './rest_types';

export type Statistics = Schemas['StatisticsView'];
export type LogBook = Schemas['LogBookView'];
export type Month = Schemas['MonthView'];
export type MaintenanceTask = Schemas['TaskView'];

/** Empty fields: any. Times of arming. */
export interface Period {
  readonly droneId: number | null;
  readonly fromIso: string;
  readonly untilIso: string;
}

export const EVER: Period = { droneId: null, fromIso: '', untilIso: '' };

const times = ({ fromIso, untilIso }: Period): { since?: string; until?: string } => ({
  ...(fromIso === '' ? {} : { since: fromIso }),
  ...(untilIso === '' ? {} : { until: untilIso }),
});

/** Raises RestError. */
export async function readStatistics(rest: Pick<Rest, 'call'>, period: Period): Promise<Statistics> {
  const query = { ...times(period), ...(period.droneId === null ? {} : { drone_id: period.droneId }) };
  return rest.call('GET', '/statistics', { query });
}

/** Of whoever is signed in, of all drones. Raises RestError. */
export async function readLogBook(rest: Pick<Rest, 'call'>, period: Period): Promise<LogBook> {
  return rest.call('GET', '/log-book', { query: times(period) });
}

export type StatisticsTable = 'drones' | 'pilots' | 'flights' | 'log-book';

/** The address of a table as CSV. */
export function csvHref(table: StatisticsTable, period: Period): string {
  const query = new URLSearchParams(times(period));
  if (table !== 'log-book') {
    query.set('by', table);
    if (period.droneId !== null) query.set('drone_id', String(period.droneId));
  }
  const asked = query.toString();
  return `/api/v1/${table === 'log-book' ? 'log-book' : 'statistics'}/csv${asked && `?${asked}`}`;
}

/** The same months with those in between that have no flight. `month`: as 2026-05. */
export function withoutGaps(months: readonly Month[]): readonly Month[] {
  if (months.length === 0) return [];
  const found = new Map(months.map((one) => [one.month, one]));
  const [first, last] = [months[0]!.month, months[months.length - 1]!.month].map(monthNumber);
  return Array.from({ length: last! - first! + 1 }, (_, at) => {
    const month = monthName(first! + at);
    return found.get(month) ?? { month, flights: 0, hours: 0 };
  });
}

const monthNumber = (month: string): number => Number(month.slice(0, 4)) * 12 + Number(month.slice(5)) - 1;

const monthName = (number: number): string =>
  `${Math.floor(number / 12)}-${String((number % 12) + 1).padStart(2, '0')}`;
