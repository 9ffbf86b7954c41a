/** What somebody who is signed in may begin with. */

import type { User } from './wire_types';

/** Not before a first password was changed, nor before a second factor was set up that the tower demands. */
export function mayGoLive(user: User | null): boolean {
  return user !== null && user.must_change_password !== true && user.must_add_second_factor !== true;
}
