/** The consequences for a user, and for the drone, when they lose ownership or a loan. */

import { t } from '../../languages/text';
import type { Account, NamedRef } from '../../link/admin_types';
import type { Drone } from '../../link/wire_types';

/** The question's text before `user` loses ownership of `drone`, or a loan of it. */
export function lossOfAccess(drone: Drone, user: NamedRef, users: readonly Account[]): string {
  if (users.find(({ id }) => id === user.id)?.role === 'admin')
    return t('{user} is an admin, and can still see and fly {drone}.', { user: user.name, drone: drone.name });
  const sees = t('{drone} leaves the squad of {user} at once.', { drone: drone.name, user: user.name });
  return drone.holder?.id === user.id
    ? t('{sees} {user} is flying it: {drone} is ordered to hold and has no pilot from then on.', {
        sees,
        user: user.name,
        drone: drone.name,
      })
    : sees;
}
