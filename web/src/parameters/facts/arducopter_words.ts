/** All texts about ArduCopter's parameters. */

import { ARDUCOPTER } from './arducopter';
import { ARDUCOPTER_CONTROL } from './arducopter_control';
import { ARDUCOPTER_FAMILIES } from './arducopter_families';
import { ARDUCOPTER_SENSORS } from './arducopter_sensors';
import { ARDUCOPTER_SYSTEM } from './arducopter_system';

export const ARDUCOPTER_WORDS = [
  ARDUCOPTER,
  ARDUCOPTER_CONTROL,
  ARDUCOPTER_SENSORS,
  ARDUCOPTER_SYSTEM,
  ARDUCOPTER_FAMILIES,
].join('\n');
