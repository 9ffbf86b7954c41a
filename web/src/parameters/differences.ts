/** Compares one table of parameters with another: of a file, the defaults, or another drone. */

import { factOf, type Facts } from './facts';
import { isSame, type Table } from './kinds';

export interface Difference {
  readonly name: string;
  readonly kind: number;
  readonly here: number;
  readonly there: number;
  /** Specific to this machine (a calibration, a serial number, a counter): another drone's value would be wrong. */
  readonly isOwn: boolean;
}

export interface Comparison {
  readonly differences: readonly Difference[];
  /** How many are the same in both. */
  readonly same: number;
  /** Names that this drone does not have. */
  readonly unknownHere: readonly string[];
  /** How many of this drone's parameters the other side lacks. */
  readonly onlyHere: number;
}

/** Calibrations, identities, counters. Also radio ranges and trims: they depend on the transmitter and the airframe. */
const OWN: readonly RegExp[] = [
  /^COMPASS_(OFS|DIA|ODI|MOT|SCALE|DEV_ID|PRIO)/,
  /^INS\d?_.*(OFFS|SCAL|CALTEMP|_ID$|ACC\d?_ID|GYR\d?_ID|GYR_ID|ACC_ID)/,
  /^INS_TCAL/,
  /^AHRS_TRIM_/,
  /^BARO\d?_(GND_PRESS|DEVID|GND_TEMP|ALT_OFFSET)/,
  /^ARSPD\d?_(OFFSET|DEVID|RATIO)/,
  /^(STAT_|SIM_|FORMAT_VERSION|SYSID_SW|MIS_TOTAL|FENCE_TOTAL|RALLY_TOTAL)/,
  /^(SYSID_THISMAV|MAV_SYS_ID|MAV_SYSID|BRD_SERIAL_NUM)$/,
  /^RC\d+_(MIN|MAX|TRIM)$/,
  /^CAL_(ACC|GYRO|MAG|BARO)\d*_/,
  /^(SENS_BOARD_[XYZ]_OFF|SENS_DPRES_OFF|TC_|LND_FLIGHT|COM_FLIGHT_UUID|SYS_PARAM_VER)/,
  /_DEVID$/,
];

export const isOwnValue = (name: string): boolean => OWN.some((pattern) => pattern.test(name));

export function compared(here: Table, there: Iterable<readonly [string, number]>): Comparison {
  const differences: Difference[] = [];
  const unknownHere: string[] = [];
  let same = 0;
  for (const [name, value] of there) {
    const parameter = here.get(name);
    if (!parameter) unknownHere.push(name);
    else if (isSame(parameter.value, value, parameter.kind)) same += 1;
    else {
      const { kind } = parameter;
      differences.push({ name, kind, here: parameter.value, there: value, isOwn: isOwnValue(name) });
    }
  }
  differences.sort((a, b) => (a.name < b.name ? -1 : 1));
  return { differences, same, unknownHere, onlyHere: here.size - same - differences.length };
}

/** The known defaults of this drone's parameters. */
export function standards(here: Table, facts: Facts): [string, number][] {
  const found: [string, number][] = [];
  for (const name of here.keys()) {
    const standard = factOf(facts, name)?.standard ?? null;
    if (standard !== null) found.push([name, standard]);
  }
  return found;
}
