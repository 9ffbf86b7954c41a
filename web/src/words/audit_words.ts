/** Details of an audit trail event beyond user, action and drone. */

import { t } from '../languages/text';
import { dateMinute } from './dates';

const MOMENT = /^\d{4}-\d\d-\d\dT\d\d:\d\d/;

/** `name: value` pairs; omits an id beside its name, and pairs without a value. */
export function detailWords(detail: Readonly<Record<string, unknown>>): string {
  return Object.entries(detail)
    .filter(([name, value]) => value !== null && !(name.endsWith('_id') && name.slice(0, -'_id'.length) in detail))
    .map(([name, value]) => `${name.replaceAll('_', ' ')}: ${valueWords(value)}`)
    .join(', ');
}

function valueWords(value: unknown): string {
  if (typeof value === 'string') return MOMENT.test(value) ? dateMinute(value) : value;
  if (typeof value === 'boolean') return value ? t('yes') : t('no');
  return JSON.stringify(value);
}
