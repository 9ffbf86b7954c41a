/** Numbers as text of constant width in the chosen language, and a dash for unknown values. */

import { inLanguage } from '../languages/text';
import type { Place } from '../link/messages';

export const UNKNOWN = '–';

export function fixed(value: number | null, decimals = 0): string {
  if (value === null || !Number.isFinite(value)) return UNKNOWN;
  const text = value.toFixed(decimals);
  // -0.0 would suggest a movement that does not exist.
  return inLanguage(Number(text) === 0 ? (0).toFixed(decimals) : text.replace('-', '−'));
}

/** For machines: the plain number, or nothing. */
export function plain(value: number | null, decimals = 2): string {
  return value === null || !Number.isFinite(value) ? '' : String(Number(value.toFixed(decimals)));
}

export function clockTime(atMs: number): string {
  return new Date(atMs).toISOString().slice(11, 19);
}

export function duration(ms: number | null): string {
  if (ms === null) return UNKNOWN;
  const seconds = Math.max(0, Math.floor(ms / 1000));
  const two = (value: number): string => String(value).padStart(2, '0');
  return `${two(Math.floor(seconds / 60))}:${two(seconds % 60)}`;
}

export function distance(metres: number | null): string {
  if (metres === null) return UNKNOWN;
  return metres < 1000 ? `${metres.toFixed(0)} m` : `${inLanguage((metres / 1000).toFixed(2))} km`;
}

export function latLon({ latDeg, lonDeg }: Place, decimals = 5): string {
  return `${latDeg.toFixed(decimals)}, ${lonDeg.toFixed(decimals)}`;
}
