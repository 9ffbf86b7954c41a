/** What an admin's action against a user does to the drones that this user is flying. Shown before the action. */

import { t } from './languages/text';
import type { NamedRef } from './link/admin_types';
import { tower } from './tower.svelte';

/** A sentence that names the drones; empty if the user flies none. */
export function flownNow(user: NamedRef): string {
  const names = [...tower.vehicles.get().values()]
    .map((vehicle) => vehicle.drone.get())
    .filter(({ holder }) => holder?.id === user.id)
    .map(({ name }) => name);
  if (names.length === 0) return '';
  return t('{user} is flying {names}: ordered to hold, with no pilot from then on.', {
    user: user.name,
    names: names.join(` ${t('and')} `),
  });
}
