/** Why an autopilot cannot be asked for its flight logs now, by anybody. Pure. */

import { t } from '../languages/text';

interface LogSituation {
  readonly name: string;
  readonly online: boolean;
  readonly isConnected: boolean;
  /** Null: unknown. */
  readonly isAirborne: boolean | null;
  readonly isBusy: boolean;
}

/** Empty if it can be asked. */
export function whyNoLogs({ name, online, isConnected, isAirborne, isBusy }: LogSituation): string {
  if (!isConnected) return t('No connection to the tower.');
  if (!online) return t('{name} is offline.', { name });
  if (isAirborne) return t('{name} is in the air: its logs are read on the ground.', { name });
  return isBusy ? t('{name} is sending logs: it does one thing at a time.', { name }) : '';
}
