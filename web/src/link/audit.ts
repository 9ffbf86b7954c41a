/** The filters of the audit trail, and its download address. */

import type { RequestOf } from './rest_types';

type AuditQuery = NonNullable<RequestOf<'GET', '/audit'>['query']>;

/** As typed. Empty strings filter nothing. */
export type AuditFilters = Readonly<Record<'action' | 'actor' | 'drone_id' | 'since' | 'until', string>>;

/** Only the filters that are set. */
export function auditQuery({ drone_id, ...texts }: AuditFilters): AuditQuery {
  const typed = Object.fromEntries(Object.entries(texts).filter(([, text]) => text !== ''));
  return drone_id === '' ? typed : { ...typed, drone_id: Number(drone_id) };
}

/** The address of the audit trail as CSV. */
export function auditCsvHref(filters: AuditFilters): string {
  const set = Object.entries(auditQuery(filters)).map(([name, value]) => [name, String(value)]);
  return `/api/v1/audit.csv${set.length > 0 ? `?${new URLSearchParams(set).toString()}` : ''}`;
}
