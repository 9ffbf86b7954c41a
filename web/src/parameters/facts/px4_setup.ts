/** The parameters of PX4 that its set-up consists of. */

import type { SetupGroups } from '../../setup/setup_groups';

export const PX4_SETUP: SetupGroups = {
  modes: [
    ['Switch', ['RC_MAP_FLTMODE']],
    ['Positions of the switch', ['COM_FLTMODE#']],
    ['Other switches', ['RC_MAP_RETURN_SW', 'RC_MAP_LOITER_SW', 'RC_MAP_KILL_SW', 'RC_MAP_ARM_SW', 'RC_MAP_OFFB_SW']],
    ['Sticks', ['COM_RC_IN_MODE', 'RC_MAP_ROLL', 'RC_MAP_PITCH', 'RC_MAP_THROTTLE', 'RC_MAP_YAW']],
  ],
  failsafes: [
    ['Sticks', ['NAV_RCL_ACT', 'COM_RC_LOSS_T', 'COM_RCL_EXCEPT']],
    ['Ground station', ['NAV_DLL_ACT', 'COM_DL_LOSS_T']],
    ['Battery', ['COM_LOW_BAT_ACT', 'BAT_LOW_THR', 'BAT_CRIT_THR', 'BAT_EMERGEN_THR']],
    ['Position and crash', ['COM_POSCTL_NAVL', 'COM_POS_LOW_ACT', 'FD_FAIL_P', 'FD_FAIL_R', 'COM_ACT_FAIL_ACT']],
    ['Return', ['RTL_RETURN_ALT', 'RTL_DESCEND_ALT', 'RTL_LAND_DELAY', 'RTL_TYPE', 'RTL_CONE_ANG']],
    ['Arming', ['COM_ARM_WO_GPS', 'COM_DISARM_LAND', 'COM_DISARM_PRFLT', 'CBRK_SUPPLY_CHK']],
  ],
  fence: [
    ['Fence', ['GF_ACTION', 'GF_PREDICT', 'GF_SOURCE']],
    ['Borders', ['GF_MAX_HOR_DIST', 'GF_MAX_VER_DIST']],
  ],
  power: [
    [
      'Battery 1',
      ['BAT1_SOURCE', 'BAT1_N_CELLS', 'BAT1_CAPACITY', 'BAT1_V_CHARGED', 'BAT1_V_EMPTY', 'BAT1_V_DIV', 'BAT1_A_PER_V'],
    ],
    ['Battery 2', ['BAT2_SOURCE', 'BAT2_N_CELLS', 'BAT2_CAPACITY', 'BAT2_V_CHARGED', 'BAT2_V_EMPTY']],
    ['Hover', ['MPC_THR_HOVER', 'MPC_THR_MIN', 'MPC_THR_MAX']],
  ],
  frame: [
    ['Frame', ['SYS_AUTOSTART', 'CA_AIRFRAME', 'CA_ROTOR_COUNT']],
    ['Motors', ['PWM_MAIN_FUNC#', 'PWM_AUX_FUNC#', 'COM_MOT_TEST_EN']],
    ['Board', ['SENS_BOARD_ROT', 'SENS_BOARD_X_OFF', 'SENS_BOARD_Y_OFF', 'SENS_BOARD_Z_OFF']],
  ],
};
