/** Whether a signed-in user may begin to use the console. */

import type { User } from './wire_types';

/** Not before the user changes a first password, or sets up a second factor that the tower demands. */
export function mayGoLive(user: User | null): boolean {
  return user !== null && user.must_change_password !== true && user.must_add_second_factor !== true;
}
