/** A zone in words: what it says, where in height, and when. */

import type { Zone, ZoneKind } from '../link/zones';
import { dateMinute } from './dates';

export const KIND_LABELS: Record<ZoneKind, string> = {
  'no-fly': 'No-fly zone',
  'height-limit': 'Height limit',
  corridor: 'Corridor',
};

export function heightWords({
  kind,
  floor_m: floor = null,
  ceiling_m: ceiling = null,
  height_above: above,
}: Zone): string {
  const of = above === 'sea' ? ' above the sea' : '';
  if (kind === 'height-limit') return `at most ${ceiling} m${of}`;
  if (floor !== null && ceiling !== null) return `${floor} to ${ceiling} m${of}`;
  if (ceiling !== null) return `up to ${ceiling} m${of}`;
  return floor !== null ? `from ${floor} m${of}` : 'all heights';
}

export function timeWords({ valid_from: from, valid_until: until }: Zone): string {
  if (from && until) return `${dateMinute(from)} to ${dateMinute(until)} UTC`;
  if (from) return `from ${dateMinute(from)} UTC`;
  return until ? `until ${dateMinute(until)} UTC` : 'always';
}

export const zoneWords = (zone: Zone): string =>
  [KIND_LABELS[zone.kind], heightWords(zone), timeWords(zone), zone.rule === 'warn' ? 'only warns' : '']
    .filter(Boolean)
    .join(', ');
