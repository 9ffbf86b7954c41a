/** How the drone must lie, and how a compass is doing, in words. */

/** By ACCELCAL_VEHICLE_POS. */
export const ACCELCAL_POSITIONS: Readonly<Record<number, string>> = {
  1: 'level, as it stands',
  2: 'on its left side',
  3: 'on its right side',
  4: 'with its nose down',
  5: 'with its nose up',
  6: 'on its back',
};

export const MAG_CAL_SUCCESS = 4;

/** By MAG_CAL_STATUS; numbers here, because only this page needs them. */
export const MAG_CAL_STATES: Readonly<Record<number, string>> = {
  0: 'not started',
  1: 'waits to start',
  2: 'turn it about every axis',
  3: 'turn it on',
  [MAG_CAL_SUCCESS]: 'done',
  5: 'failed: try farther from metal',
  6: 'failed: mounted otherwise than its parameter says',
  7: 'failed: the field is too weak or too strong',
  8: 'failed: too much metal near it',
  9: 'failed: its axes do not fit each other',
  10: 'failed: the field changes, as near metal',
};
