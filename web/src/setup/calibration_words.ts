/** How the drone must lie, and how a compass is doing, in words. */

import { t } from '../languages/text';

/** By ACCELCAL_VEHICLE_POS. */
export const ACCELCAL_POSITIONS: Readonly<Record<number, string>> = {
  1: t('level, as it stands'),
  2: t('on its left side'),
  3: t('on its right side'),
  4: t('with its nose down'),
  5: t('with its nose up'),
  6: t('on its back'),
};

export const MAG_CAL_SUCCESS = 4;

/** By MAG_CAL_STATUS; numbers here, because only this page needs them. */
export const MAG_CAL_STATES: Readonly<Record<number, string>> = {
  0: t('not started'),
  1: t('waits to start'),
  2: t('turn it about every axis'),
  3: t('turn it on'),
  [MAG_CAL_SUCCESS]: t('done'),
  5: t('failed: try farther from metal'),
  6: t('failed: mounted otherwise than its parameter says'),
  7: t('failed: the field is too weak or too strong'),
  8: t('failed: too much metal near it'),
  9: t('failed: its axes do not fit each other'),
  10: t('failed: the field changes, as near metal'),
};
