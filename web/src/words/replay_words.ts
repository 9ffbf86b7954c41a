/** A replay in words. */

import { t } from '../languages/text';
import type { MarkKind } from '../replay/marks';

export const MARK_WORDS: Record<MarkKind, string> = {
  controls: t('Controls'),
  hold: t('Hold'),
  command: t('Command'),
  alert: t('Alert'),
  sticks: t('Sticks'),
  link: t('Link'),
  mode: t('Mode'),
  text: t('Autopilot'),
  flight: t('Flight'),
};

const two = (value: number): string => String(value).padStart(2, '0');

/** `04:07` or `1:04:07`, from the beginning. */
export function playedTime(ms: number): string {
  const seconds = Math.max(0, Math.floor((ms + 0.5) / 1000));
  const hours = Math.floor(seconds / 3600);
  const rest = `${two(Math.floor((seconds % 3600) / 60))}:${two(seconds % 60)}`;
  return hours > 0 ? `${hours}:${rest}` : rest;
}

/** The same with tenths. */
export const playedTenths = (ms: number): string => `${playedTime(ms)}.${Math.floor((Math.max(0, ms) % 1000) / 100)}`;

export const speedWords = (speed: number): string => `${speed}×`;
