/** Stream profiles in words. */

import { t } from '../languages/text';
import type { Drone, StreamProfile } from '../link/wire_types';

/** The choices, as the settings show them. */
export const PROFILE_CHOICES: Record<StreamProfile | 'auto', string> = {
  auto: t('As much as its link carries'),
  full: t('Everything'),
  thin: t('Less: for a weak link'),
  minimal: t('Minimum: position, height, battery, mode'),
};

/** One line on a drone that sends reduced telemetry; empty while it sends everything, or if unknown. */
export function thinnedWords(drone: Pick<Drone, 'profile' | 'profile_why'>): string {
  if (drone.profile === null || drone.profile === 'full') return '';
  const name = drone.profile === 'thin' ? t('Thin') : t('Minimal');
  return t('{name} stream{what}', { name, what: drone.profile_why ? `: ${drone.profile_why}` : '' });
}
