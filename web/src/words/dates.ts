/** Moments and spans of accounts and records: dates in UTC, as all times of the console. */

import { currentLanguage, inLanguage, t } from '../languages/text';
import { UNKNOWN } from './format';

const MINUTE_S = 60;
const HOUR_S = 3600;
const DAY_S = 86_400;

const ISO_MINUTE = 'YYYY-MM-DD HH:MM'.length;
const ISO_SECOND = 'YYYY-MM-DD HH:MM:SS'.length;

function written(iso: string | null, hasSeconds: boolean): string {
  if (!iso) return UNKNOWN;
  const at = new Date(iso);
  if (Number.isNaN(at.getTime())) return UNKNOWN;
  const language = currentLanguage();
  if (language === 'en') return isoDate(at, hasSeconds);
  return new Intl.DateTimeFormat(language, {
    dateStyle: 'short',
    timeStyle: hasSeconds ? 'medium' : 'short',
    hourCycle: 'h23',
    timeZone: 'UTC',
  }).format(at);
}

const isoDate = (at: Date, hasSeconds: boolean): string =>
  at
    .toISOString()
    .slice(0, hasSeconds ? ISO_SECOND : ISO_MINUTE)
    .replace('T', ' ');

/** `2026-03-04 05:06:07`, in UTC; as the chosen language writes it. */
export const dateTime = (iso: string | null): string => written(iso, true);

/** `2026-03-04 05:06`, in UTC, without seconds; as the chosen language writes it. */
export const dateMinute = (iso: string | null): string => written(iso, false);

/** `2026-03-04 05:06:07` in every language, for names of files. */
export const fileTime = (iso: string): string => isoDate(new Date(iso), true);

/** `3 min`, `2 h 5 min`, `5 d 1 h`: as precise as a reader needs. */
export function span(seconds: number): string {
  const whole = Math.max(0, seconds);
  if (whole < MINUTE_S) return `${Math.floor(whole)} s`;
  if (whole < HOUR_S) return `${Math.floor(whole / MINUTE_S)} min`;
  return whole < 2 * DAY_S ? inTwo(whole, HOUR_S, 'h', MINUTE_S, 'min') : inTwo(whole, DAY_S, 'd', HOUR_S, 'h');
}

function inTwo(seconds: number, longS: number, long: string, shortS: number, short: string): string {
  const rest = Math.floor((seconds % longS) / shortS);
  return `${Math.floor(seconds / longS)} ${long}${rest > 0 ? ` ${rest} ${short}` : ''}`;
}

export function ago(iso: string | null, nowMs: number): string {
  if (!iso) return t('never');
  return t('{now} ago', { now: span((nowMs - new Date(iso).getTime()) / 1000) });
}

export function fromNow(iso: string, nowMs: number): string {
  const seconds = (new Date(iso).getTime() - nowMs) / 1000;
  return seconds > 0 ? t('in {seconds}', { seconds: span(seconds) }) : t('over');
}

export function bytes(count: number | null): string {
  if (count === null) return UNKNOWN;
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  let value = count;
  let at = 0;
  while (value >= 1000 && at < units.length - 1) {
    value /= 1000;
    at += 1;
  }
  return `${at === 0 ? value : inLanguage(value.toFixed(value < 10 ? 1 : 0))} ${units[at]}`;
}

/** Takes the value of a `datetime-local` field as UTC, as the field's label says. Empty for an invalid date. */
export function isoOfField(local: string): string {
  const at = new Date(`${local}Z`);
  return local && !Number.isNaN(at.getTime()) ? at.toISOString() : '';
}

export function fieldOfMs(atMs: number): string {
  return new Date(atMs).toISOString().slice(0, 16);
}
