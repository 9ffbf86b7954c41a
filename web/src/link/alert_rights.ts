/** Who may acknowledge an alert: the pilots of its drone, as the tower decides (server/kernel/relations.py). Pure. */

import type { Alert } from './alerts';
import type { Drone, User } from './wire_types';

/** Whoever gets an alert about the tower itself may. `drone`: undefined if this page does not have it. */
export function mayAcknowledge(
  alert: Pick<Alert, 'drone_id'>,
  drone: Pick<Drone, 'relation'> | undefined,
  user: Pick<User, 'role'>,
): boolean {
  if (alert.drone_id === null) return true;
  return drone !== undefined && user.role !== 'observer' && drone.relation !== 'observer';
}
