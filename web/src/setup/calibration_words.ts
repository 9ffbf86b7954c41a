/** How the drone must lie, and how a compass is doing, in words. */

import { MAG_CAL_STATUS } from '../link/generated/mavlink.gen';

/** By ACCELCAL_VEHICLE_POS. */
export const ACCELCAL_POSITIONS: Readonly<Record<number, string>> = {
  1: 'level, as it stands',
  2: 'on its left side',
  3: 'on its right side',
  4: 'with its nose down',
  5: 'with its nose up',
  6: 'on its back',
};

/** By MAG_CAL_STATUS. */
export const MAG_CAL_STATES: Readonly<Record<number, string>> = {
  [MAG_CAL_STATUS.MAG_CAL_NOT_STARTED]: 'not started',
  [MAG_CAL_STATUS.MAG_CAL_WAITING_TO_START]: 'waits to start',
  [MAG_CAL_STATUS.MAG_CAL_RUNNING_STEP_ONE]: 'turn it about every axis',
  [MAG_CAL_STATUS.MAG_CAL_RUNNING_STEP_TWO]: 'turn it on',
  [MAG_CAL_STATUS.MAG_CAL_SUCCESS]: 'done',
  [MAG_CAL_STATUS.MAG_CAL_FAILED]: 'failed: try farther from metal',
  [MAG_CAL_STATUS.MAG_CAL_FAILED_ORIENTATION]: 'failed: mounted otherwise than its parameter says',
  [MAG_CAL_STATUS.MAG_CAL_FAILED_RADIUS]: 'failed: the field is too weak or too strong',
  [MAG_CAL_STATUS.MAG_CAL_FAILED_OFFSETS]: 'failed: too much metal near it',
  [MAG_CAL_STATUS.MAG_CAL_FAILED_DIAG_SCALING]: 'failed: its axes do not fit each other',
  [MAG_CAL_STATUS.MAG_CAL_FAILED_RESIDUALS_HIGH]: 'failed: the field changes, as near metal',
};
