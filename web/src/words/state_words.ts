/** The states of a drone in words. */

import type { DroneState } from '../link/flight_values';

export const STATE_WORDS: Record<DroneState, string> = {
  alert: 'Alert',
  flying: 'Flying',
  armed: 'Armed',
  idle: 'Idle',
  lost: 'Link lost',
};
