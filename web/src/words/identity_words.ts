/** How the tower identifies a drone's agent, in words. */

import { t } from '../languages/text';
import type { DroneIdentity } from '../link/wire_types';
import { dateMinute } from './dates';

/** `SHA256:` and 12 characters are enough to compare by eye; the whole fingerprint is shown as well. */
const SHOWN = 'SHA256:'.length + 12;

export function identityWords(identity: DroneIdentity | undefined): string {
  switch (identity?.kind) {
    case 'key':
      return t('{fingerprint}…, since {since}', {
        fingerprint: (identity.fingerprint ?? '').slice(0, SHOWN),
        since: dateMinute(identity.since),
      });
    case 'credential':
      return t('a credential, until its next sign-in');
    case 'none':
      return t('not enrolled');
    case undefined:
      return '';
  }
}
