/** The states of a drone in words. */

import { t } from '../languages/text';
import type { DroneState } from '../link/flight_values';

export const STATE_WORDS: Record<DroneState, string> = {
  alert: t('Alert'),
  flying: t('Flying'),
  armed: t('Armed'),
  idle: t('Idle'),
  lost: t('Link lost'),
};
