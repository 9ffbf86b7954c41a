/** Texts about measures against a drone that sends too much. */

import { t } from '../languages/text';
import type { Drone, Measure } from '../link/wire_types';

export const MEASURE_WORDS: Record<Measure, { readonly name: string; readonly act: (drone: string) => string }> = {
  muted: { name: t('Mute'), act: (drone) => t('Mute {drone}', { drone }) },
  limited: { name: t('Limit its telemetry'), act: (drone) => t('Limit {drone}', { drone }) },
  quarantined: { name: t('Quarantine'), act: (drone) => t('Quarantine {drone}', { drone }) },
};

const DONE: Record<Measure, (drone: string) => string> = {
  muted: (drone) => t('{drone} is muted.', { drone }),
  limited: (drone) => t('The telemetry of {drone} is limited.', { drone }),
  quarantined: (drone) => t('{drone} is in quarantine: it gets no link.', { drone }),
};

/** What is done about the drone, by whom and why; empty: nothing is. */
export function restraintWords({ name, restraint }: Pick<Drone, 'name' | 'restraint'>): string {
  if (!restraint) return '';
  const { measure, by, reason } = restraint;
  const done = DONE[measure](name);
  if (by === null) return t('{done} The tower does so by itself: it sent {reason}.', { done, reason });
  return reason ? t('{done} By {by}: {reason}', { done, by, reason }) : t('{done} By {by}.', { done, by });
}

/** Whether this user may do something about it: an admin of the tower or of the drone's team. */
export const mayRestrain = ({ relation }: Pick<Drone, 'relation'>): boolean =>
  relation === 'admin' || relation === 'team-admin';
