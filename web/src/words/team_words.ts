/** Texts about teams. */

import { t } from '../languages/text';
import type { NamedRef } from '../link/admin_types';
import type { TeamRole } from '../link/team_types';
import type { Drone } from '../link/wire_types';

export const ROLE_WORDS: Record<TeamRole, { readonly label: string; readonly does: string }> = {
  observer: { label: t('Observer'), does: t('watches') },
  operator: { label: t('Operator'), does: t('watches and flies') },
  admin: { label: t('Team admin'), does: t('flies, takes control, looks after the team') },
};

/** What happens to the drones that a user flies when they lose access. */
export function flownThen(drones: readonly Drone[], userIds: readonly number[] | null): string {
  const flown = drones.filter(({ holder }) => holder && (userIds === null || userIds.includes(holder.id)));
  return flown
    .map(({ name, holder }) =>
      t('{holder} has the controls of {name} now: {name} is ordered to hold.', { holder: holder?.name, name }),
    )
    .join(' ');
}

/** The drones that this user may add to a team. */
export const freeToJoin = (drones: readonly Drone[], user: NamedRef, isAdmin: boolean): Drone[] =>
  drones.filter(({ owners, team }) => !team && (isAdmin || owners.some(({ id }) => id === user.id)));
