/** The progress of an enrolment, in words. */

import { t } from '../languages/text';
import type { Enrolment } from '../link/admin_types';
import { fromNow } from './dates';

export function enrolmentWords({ state, expires_at, used_from, drone }: Enrolment, nowMs: number): string {
  const from = used_from ? ` ${t('from {usedFrom}', { usedFrom: used_from })}` : '';
  switch (state) {
    case 'waiting':
      return t('Waiting for {drone}. The token ends {expiresAt}.', {
        drone: drone.name,
        expiresAt: fromNow(expires_at, nowMs),
      });
    case 'used':
      return t('{drone} has a key{from}. Waiting for its agent to link.', { drone: drone.name, from });
    case 'seen':
      return t('{drone} is enrolled: its agent has linked{from}.', { drone: drone.name, from });
    case 'expired':
      return t('The token ended before it was used. Make another command.');
    case 'cancelled':
      return t('This token was cancelled: another one took its place, or somebody ended it.');
  }
}
