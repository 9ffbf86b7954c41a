/** The consequences for a user, and for the drone, when they lose ownership or a loan. */

import type { Account, NamedRef } from '../../link/admin_types';
import type { Drone } from '../../link/wire_types';

/** The question's text before `user` loses ownership of `drone`, or a loan of it. */
export function lossOfAccess(drone: Drone, user: NamedRef, users: readonly Account[]): string {
  if (users.find(({ id }) => id === user.id)?.role === 'admin')
    return `${user.name} is an admin, and can still see and fly ${drone.name}.`;
  const sees = `${drone.name} leaves the squad of ${user.name} at once.`;
  return drone.holder?.id === user.id
    ? `${sees} ${user.name} is flying it: ${drone.name} is ordered to hold and has no pilot from then on.`
    : sees;
}
