/** The parameters of ArduCopter that its set-up consists of. */

import type { SetupGroups } from '../../setup/setup_groups';

export const ARDUCOPTER_SETUP: SetupGroups = {
  modes: [
    ['Switch', ['FLTMODE_CH']],
    ['Positions of the switch', ['FLTMODE#']],
    ['Simple modes', ['SIMPLE', 'SUPER_SIMPLE']],
    ['Other switches', ['RC#_OPTION']],
  ],
  failsafes: [
    ['Radio', ['FS_THR_ENABLE', 'FS_THR_VALUE', 'RC_FS_TIMEOUT']],
    ['Ground station', ['FS_GCS_ENABLE', 'FS_GCS_TIMEOUT']],
    [
      'Battery',
      ['BATT_FS_LOW_ACT', 'BATT_LOW_VOLT', 'BATT_LOW_MAH', 'BATT_FS_CRT_ACT', 'BATT_CRT_VOLT', 'BATT_CRT_MAH'],
    ],
    ['Estimator and crash', ['FS_EKF_ACTION', 'FS_EKF_THRESH', 'FS_CRASH_CHECK', 'FS_VIBE_ENABLE', 'FS_DR_ENABLE']],
    ['Exceptions', ['FS_OPTIONS']],
    [
      'Return',
      ['RTL_ALT', 'RTL_ALT_M', 'RTL_ALT_FINAL', 'RTL_ALT_FINAL_M', 'RTL_LOIT_TIME', 'RTL_SPEED', 'RTL_SPEED_MS'],
    ],
    ['Checks before arming', ['ARMING_CHECK', 'ARMING_SKIPCHK']],
  ],
  fence: [
    ['Fence', ['FENCE_ENABLE', 'FENCE_AUTOENABLE', 'FENCE_TYPE', 'FENCE_ACTION']],
    ['Borders', ['FENCE_ALT_MAX', 'FENCE_ALT_MIN', 'FENCE_RADIUS', 'FENCE_MARGIN']],
  ],
  power: [
    [
      'Sensor',
      ['BATT_MONITOR', 'BATT_VOLT_PIN', 'BATT_CURR_PIN', 'BATT_VOLT_MULT', 'BATT_AMP_PERVLT', 'BATT_AMP_OFFSET'],
    ],
    ['Battery', ['BATT_CAPACITY', 'BATT_ARM_VOLT', 'BATT_ARM_MAH', 'BATT_LOW_TIMER']],
    [
      'Motors',
      ['MOT_BAT_VOLT_MIN', 'MOT_BAT_VOLT_MAX', 'MOT_THST_EXPO', 'MOT_THST_HOVER', 'MOT_SPIN_ARM', 'MOT_SPIN_MIN'],
    ],
  ],
  frame: [
    ['Frame', ['FRAME_CLASS', 'FRAME_TYPE']],
    ['Motors', ['MOT_PWM_TYPE', 'MOT_PWM_MIN', 'MOT_PWM_MAX', 'SERVO#_FUNCTION']],
    ['Board', ['AHRS_ORIENTATION', 'COMPASS_ORIENT', 'COMPASS_EXTERNAL']],
  ],
};
