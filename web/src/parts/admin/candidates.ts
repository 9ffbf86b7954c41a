/** The users to whom a drone may be given or lent, as options of a Combobox. */

import type { Account } from '../../link/admin_types';
import type { Drone } from '../../link/wire_types';

export const candidates = (users: readonly Account[], drone: Drone) =>
  users
    .filter(({ id, disabled }) => !disabled && !drone.owners.some((owner) => owner.id === id))
    .map(({ id, name, role }) => ({ value: String(id), label: name, detail: role }));
