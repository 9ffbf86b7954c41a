/** A zone in words: what it says, where in height, and when. */

import { t } from '../languages/text';
import type { Zone, ZoneKind } from '../link/zones';
import { dateMinute } from './dates';

export const KIND_LABELS: Record<ZoneKind, string> = {
  'no-fly': t('No-fly zone'),
  'height-limit': t('Height limit'),
  corridor: t('Corridor'),
};

export function heightWords({
  kind,
  floor_m: floor = null,
  ceiling_m: ceiling = null,
  height_above: above,
}: Zone): string {
  const of = above === 'sea' ? ` ${t('above sea level')}` : '';
  if (kind === 'height-limit') return t('at most {ceiling} m{of}', { ceiling, of });
  if (floor !== null && ceiling !== null) return t('{floor} to {ceiling} m{of}', { floor, ceiling, of });
  if (ceiling !== null) return t('up to {ceiling} m{of}', { ceiling, of });
  return floor !== null ? t('from {floor} m{of}', { floor, of }) : t('all heights');
}

export function timeWords({ valid_from: from, valid_until: until }: Zone): string {
  if (from && until) return t('{from} to {until} UTC', { from: dateMinute(from), until: dateMinute(until) });
  if (from) return t('from {from} UTC', { from: dateMinute(from) });
  return until ? t('until {until} UTC', { until: dateMinute(until) }) : t('always');
}

export const zoneWords = (zone: Zone): string =>
  [KIND_LABELS[zone.kind], heightWords(zone), timeWords(zone), zone.rule === 'warn' ? t('only warns') : '']
    .filter(Boolean)
    .join(', ');
