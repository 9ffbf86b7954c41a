/** Stream profiles in words. */

import type { Drone, StreamProfile } from '../link/wire_types';

/** What there is to choose, as the settings show it. */
export const PROFILE_CHOICES: Record<StreamProfile | 'auto', string> = {
  auto: 'As much as its link carries',
  full: 'Everything',
  thin: 'Less: for a weak link',
  minimal: 'Least: place, height, battery, mode',
};

/** One line on a drone that sends less than all; empty while it sends everything, or nothing is known. */
export function thinnedWords(drone: Pick<Drone, 'profile' | 'profile_why'>): string {
  if (drone.profile === null || drone.profile === 'full') return '';
  const name = drone.profile === 'thin' ? 'Thin' : 'Minimal';
  return `${name} stream${drone.profile_why ? `: ${drone.profile_why}` : ''}`;
}
