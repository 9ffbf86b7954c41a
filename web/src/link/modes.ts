/** The flight modes of the autopilots we know: their names, numbers, and which of them does what. */

import { COPTER_MODE, MAV_AUTOPILOT } from './generated/mavlink.gen';

export interface Mode {
  readonly name: string;
  /** HEARTBEAT.custom_mode when it is active. */
  readonly customMode: number;
  /** Parameters 2 and 3 of DO_SET_MODE. */
  readonly main: number;
  readonly sub: number;
  /** It does what the sticks say: with nobody at them, what a radio at rest says (throttle down: it sinks). */
  readonly obeysSticks: boolean;
}

export interface ModeSet {
  readonly modes: readonly Mode[];
  /**
   * Stays where it is, with nobody at the sticks. Not ALT_HOLD: without a stream of centred sticks that falls
   * back to the radio's values, and with the throttle at rest the drone descends into the ground (measured).
   */
  readonly hold: Mode;
  readonly returns: Mode;
  readonly land: Mode;
  readonly guided: Mode | null;
  /** For flying by hand: does what the sticks say, and stays in its place when they are centred. */
  readonly byHand: Mode;
}

const words = (name: string): string => name.replaceAll('_', ' ');

const COPTER_STICK_MODES: ReadonlySet<string> = new Set([
  'STABILIZE',
  'ACRO',
  'ALT_HOLD',
  'LOITER',
  'POSHOLD',
  'CIRCLE',
]);

function copter(name: keyof typeof COPTER_MODE): Mode {
  return {
    name: words(name),
    customMode: COPTER_MODE[name],
    main: COPTER_MODE[name],
    sub: 0,
    obeysSticks: COPTER_STICK_MODES.has(name),
  };
}

const PX4_AUTO = 4;
function px4(name: string, main: number, sub = 0): Mode {
  return { name, customMode: ((main << 16) | (sub << 24)) >>> 0, main, sub, obeysSticks: main !== PX4_AUTO };
}

const ARDUCOPTER: ModeSet = {
  modes: (
    [
      'STABILIZE',
      'ALT_HOLD',
      'LOITER',
      'POSHOLD',
      'BRAKE',
      'GUIDED',
      'AUTO',
      'CIRCLE',
      'RTL',
      'SMART_RTL',
      'LAND',
    ] as const
  ).map(copter),
  hold: copter('BRAKE'),
  returns: copter('RTL'),
  land: copter('LAND'),
  guided: copter('GUIDED'),
  byHand: copter('LOITER'),
};

const PX4_MODES = {
  manual: px4('MANUAL', 1),
  altitude: px4('ALTITUDE', 2),
  position: px4('POSITION', 3),
  takeOff: px4('TAKEOFF', PX4_AUTO, 2),
  loiter: px4('LOITER', PX4_AUTO, 3),
  mission: px4('MISSION', PX4_AUTO, 4),
  returns: px4('RETURN', PX4_AUTO, 5),
  land: px4('LAND', PX4_AUTO, 6),
  precisionLand: px4('PRECISION LAND', PX4_AUTO, 9),
  stabilized: px4('STABILIZED', 7),
};

const PX4: ModeSet = {
  // A precision landing is begun by missions and returns; to choose, LAND is the mode.
  modes: Object.values(PX4_MODES).filter((mode) => mode !== PX4_MODES.precisionLand),
  hold: PX4_MODES.loiter,
  returns: PX4_MODES.returns,
  land: PX4_MODES.land,
  guided: null,
  byHand: PX4_MODES.position,
};

/** Null for an autopilot that we cannot name modes of. */
export function modeSetOf(autopilot: number): ModeSet | null {
  if (autopilot === MAV_AUTOPILOT.ARDUPILOTMEGA) return ARDUCOPTER;
  if (autopilot === MAV_AUTOPILOT.PX4) return PX4;
  return null;
}

/** Modes that keep the height and not the place. */
const ALTITUDE_HOLDS: ReadonlySet<string> = new Set(['ALT HOLD', 'ALTITUDE']);

export const driftsWithTheWind = (mode: string | null): boolean => mode !== null && ALTITUDE_HOLDS.has(mode);

export function obeysSticks(autopilot: number, customMode: number): boolean {
  return modeSetOf(autopilot)?.modes.find((mode) => mode.customMode === customMode)?.obeysSticks ?? false;
}

/** What a drone in the air does in a mode, as far as losing somebody goes. */
export type FlightTask = 'mission' | 'return' | 'landing' | 'by-hand' | 'by-itself';

const COPTER_TASKS: Readonly<Record<number, FlightTask>> = {
  [COPTER_MODE.AUTO]: 'mission',
  [COPTER_MODE.RTL]: 'return',
  [COPTER_MODE.SMART_RTL]: 'return',
  [COPTER_MODE.AUTO_RTL]: 'return',
  [COPTER_MODE.LAND]: 'landing',
};
const PX4_TASKS: Readonly<Record<number, FlightTask>> = {
  [PX4_MODES.mission.customMode]: 'mission',
  [PX4_MODES.returns.customMode]: 'return',
  [PX4_MODES.land.customMode]: 'landing',
  [PX4_MODES.precisionLand.customMode]: 'landing',
};

/** Null for a mode that we do not know. */
export function flightTask(autopilot: number | null, customMode: number | null): FlightTask | null {
  const set = autopilot === null || customMode === null ? null : modeSetOf(autopilot);
  if (set === null || customMode === null) return null;
  const task = (set === PX4 ? PX4_TASKS : COPTER_TASKS)[customMode];
  if (task) return task;
  const mode = set.modes.find((one) => one.customMode === customMode);
  return mode ? (mode.obeysSticks ? 'by-hand' : 'by-itself') : null;
}

export function modeName(autopilot: number, customMode: number): string {
  const known = modeSetOf(autopilot)?.modes.find((mode) => mode.customMode === customMode);
  if (known) return known.name;
  if (autopilot === MAV_AUTOPILOT.PX4 && customMode === PX4_MODES.precisionLand.customMode) {
    return PX4_MODES.precisionLand.name;
  }
  const other = Object.entries(COPTER_MODE).find(([, number]) => number === customMode);
  if (autopilot === MAV_AUTOPILOT.ARDUPILOTMEGA && other) return words(other[0]);
  return `MODE ${customMode}`;
}
