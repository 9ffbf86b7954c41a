/** The progress of an enrolment, in words. */

import type { Enrolment } from '../link/admin_types';
import { fromNow } from './dates';

export function enrolmentWords({ state, expires_at, used_from, drone }: Enrolment, nowMs: number): string {
  const from = used_from ? ` from ${used_from}` : '';
  switch (state) {
    case 'waiting':
      return `Waiting for ${drone.name}. The token ends ${fromNow(expires_at, nowMs)}.`;
    case 'used':
      return `${drone.name} has a key${from}. Waiting for its agent to link.`;
    case 'seen':
      return `${drone.name} is enrolled: its agent has linked${from}.`;
    case 'expired':
      return 'The token ended before it was used. Make another command.';
    case 'cancelled':
      return 'This token was cancelled: another one took its place, or somebody ended it.';
  }
}
