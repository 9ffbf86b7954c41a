/**
 * The commands that the planner knows: names, whether they have a place, parameters, and which autopilots carry them
 * out in a mission. Sources: MAVLink's common.xml, ArduPilot's mission list (Copter 4.6) and PX4's parser and
 * feasibility check. An item with another command is kept unchanged, with numbers instead of names. The tower reports
 * how an autopilot changes a value (wire/plan_keeping.py); both keep the defaults here unchanged. What one autopilot
 * lacks or requires comes from its profile (wire/autopilots/).
 */

import { t } from '../languages/text';
import { FAMILIES } from '../link/generated/autopilots.gen';

export const CMD = {
  WAYPOINT: 16,
  LOITER_UNLIMITED: 17,
  LOITER_TURNS: 18,
  LOITER_TIME: 19,
  RETURN: 20,
  LAND: 21,
  TAKEOFF: 22,
  LOITER_TO_HEIGHT: 31,
  SPLINE_WAYPOINT: 82,
  VTOL_TAKEOFF: 84,
  VTOL_LAND: 85,
  NAV_DELAY: 93,
  CONDITION_DELAY: 112,
  CONDITION_DISTANCE: 114,
  CONDITION_YAW: 115,
  JUMP: 177,
  CHANGE_SPEED: 178,
  SET_HOME: 179,
  SET_RELAY: 181,
  SET_SERVO: 183,
  LAND_START: 189,
  ROI_LOCATION: 195,
  ROI_NONE: 197,
  ROI: 201,
  CAMERA_SHOT: 203,
  MOUNT_CONTROL: 205,
  TRIGGER_DISTANCE: 206,
  GRIPPER: 211,
  GIMBAL_PITCH_YAW: 1000,
  IMAGE_START: 2000,
  IMAGE_STOP: 2001,
  VIDEO_START: 2500,
  VIDEO_STOP: 2501,
  FENCE_RETURN: 5000,
  FENCE_POLYGON_IN: 5001,
  FENCE_POLYGON_OUT: 5002,
  FENCE_CIRCLE_IN: 5003,
  FENCE_CIRCLE_OUT: 5004,
  RALLY: 5100,
} as const;

export type AutopilotKind = keyof typeof FAMILIES;

export type ParamUnit = 's' | 'm' | 'm/s' | 'deg' | 'deg/s' | '%' | 'us' | '';

export interface ParamSpec {
  /** 0 is MAVLink's parameter 1. */
  readonly at: 0 | 1 | 2 | 3;
  readonly name: string;
  readonly unit: ParamUnit;
  readonly least?: number;
  readonly most?: number;
  readonly whole?: boolean;
  readonly choices?: readonly (readonly [number, string])[];
  /** May be unset: the autopilot decides, unless its profile requires a number. */
  readonly mayBeOpen?: boolean;
  readonly initial: number | null;
}

export type PlaceUse =
  /** A place is required. */
  | 'needed'
  /** 0, 0 means "the drone's position at that time". */
  | 'here-if-none'
  | 'none';

export interface CommandSpec {
  readonly command: number;
  readonly label: string;
  readonly place: PlaceUse;
  /** z is a height to fly to or look at. */
  readonly height: boolean;
  /** The drone flies to its place. */
  readonly flies: boolean;
  readonly params: readonly ParamSpec[];
  /** Meaning of x and z without a place: more parameters. */
  readonly raw?: { readonly x?: number; readonly z?: number };
}

const param = (at: 0 | 1 | 2 | 3, name: string, unit: ParamUnit, rest: Partial<ParamSpec> = {}): ParamSpec => ({
  at,
  name,
  unit,
  initial: 0,
  ...rest,
});

/** Zero means the autopilot's own value. */
const HOLD = param(0, t('Wait at the waypoint'), 's', { least: 0, most: 65_535 });
const REACHED = param(1, t('Acceptance radius'), 'm', { least: 0, most: 1_000 });
const YAW = param(3, t('Heading'), 'deg', { least: -360, most: 360, mayBeOpen: true, initial: null });
const RADIUS = param(2, t('Radius, negative: counter-clockwise'), 'm', { least: -10_000, most: 10_000 });

function spec(
  command: number,
  label: string,
  place: PlaceUse,
  params: readonly ParamSpec[] = [],
  uses: Partial<Pick<CommandSpec, 'height' | 'flies' | 'raw'>> = {},
): CommandSpec {
  return { command, label, place, params, height: false, flies: false, ...uses };
}

/** Jumps are checked against their plan; this is only the range of the number. */
const MAX_SEQ = 65_535;

const GOES = { height: true, flies: true };

const SPECS: readonly CommandSpec[] = [
  spec(
    CMD.WAYPOINT,
    t('Waypoint'),
    'needed',
    [HOLD, REACHED, param(2, t('Pass at distance'), 'm', { least: -1_000, most: 1_000 }), YAW],
    GOES,
  ),
  spec(CMD.SPLINE_WAYPOINT, t('Spline waypoint'), 'needed', [HOLD], GOES),
  spec(CMD.TAKEOFF, t('Take-off'), 'here-if-none', [param(0, t('Pitch'), 'deg', { least: 0, most: 90 }), YAW], GOES),
  spec(CMD.VTOL_TAKEOFF, t('Take-off (VTOL)'), 'here-if-none', [YAW], GOES),
  spec(
    CMD.LAND,
    t('Land'),
    'here-if-none',
    [
      param(0, t('Abort height'), 'm', { least: 0, most: 1_000 }),
      param(1, t('Precision landing'), '', {
        choices: [
          [0, t('no')],
          [1, t('if a target is visible')],
          [2, t('required')],
        ],
      }),
      YAW,
    ],
    GOES,
  ),
  spec(
    CMD.VTOL_LAND,
    t('Land (VTOL)'),
    'here-if-none',
    [param(2, t('Approach height'), 'm', { mayBeOpen: true, least: 0, most: 1_000 }), YAW],
    GOES,
  ),
  spec(CMD.RETURN, t('Return'), 'none'),
  spec(CMD.LOITER_UNLIMITED, t('Loiter (unlimited)'), 'here-if-none', [RADIUS, YAW], GOES),
  spec(
    CMD.LOITER_TURNS,
    t('Loiter (turns)'),
    'here-if-none',
    // One byte each where an autopilot packs its items.
    [param(0, t('Turns'), '', { least: 0.1, most: 255, initial: 1 }), RADIUS],
    GOES,
  ),
  spec(
    CMD.LOITER_TIME,
    t('Loiter (time)'),
    'here-if-none',
    [param(0, t('Time'), 's', { least: 0, most: 65_535, initial: 10 }), RADIUS],
    GOES,
  ),
  spec(CMD.LOITER_TO_HEIGHT, t('Loiter to height'), 'here-if-none', [{ ...RADIUS, at: 1 }], GOES),
  spec(CMD.NAV_DELAY, t('Wait'), 'none', [
    param(0, t('Time, -1: until a time of day'), 's', { least: -1, most: 65_535, initial: 10 }),
    param(1, t('Hour (UTC), -1: any'), '', { least: -1, most: 23, whole: true, initial: -1 }),
    param(2, t('Minute, -1: any'), '', { least: -1, most: 59, whole: true, initial: -1 }),
    param(3, t('Second, -1: any'), '', { least: -1, most: 59, whole: true, initial: -1 }),
  ]),
  spec(CMD.CONDITION_DELAY, t('Delay (time)'), 'none', [
    param(0, t('Time'), 's', { least: 0, most: 65_535, initial: 5 }),
  ]),
  spec(CMD.CONDITION_DISTANCE, t('Delay (distance)'), 'none', [
    param(0, t('Distance to the next waypoint'), 'm', { least: 0, most: 100_000, initial: 10 }),
  ]),
  spec(CMD.CONDITION_YAW, t('Heading'), 'none', [
    param(0, t('Angle'), 'deg', { least: 0, most: 360 }),
    param(1, t('Turn rate'), 'deg/s', { least: 0, most: 360 }),
    param(2, t('Direction'), '', {
      choices: [
        [-1, t('counter-clockwise')],
        [0, t('shortest')],
        [1, t('clockwise')],
      ],
    }),
    param(3, t('Reference'), '', {
      choices: [
        [0, t('north')],
        [1, t('current heading')],
      ],
    }),
  ]),
  spec(CMD.JUMP, t('Jump'), 'none', [
    param(0, t('To item'), '', { least: 0, most: MAX_SEQ, whole: true }),
    param(1, t('Repeats, -1: forever'), '', { least: -1, most: 32_767, whole: true, initial: 1 }),
  ]),
  spec(CMD.CHANGE_SPEED, t('Speed'), 'none', [
    param(0, t('Type'), '', {
      choices: [
        [0, t('airspeed')],
        [1, t('ground speed')],
        [2, t('climb speed')],
        [3, t('descent speed')],
      ],
      initial: 1,
    }),
    param(1, t('Speed, -1: no change, -2: default'), 'm/s', { least: -2, most: 150, initial: 5 }),
    param(2, t('Throttle, -1: no change, -2: default'), '%', { least: -2, most: 100, initial: -1 }),
  ]),
  spec(
    CMD.SET_HOME,
    t('Set home'),
    'here-if-none',
    [
      param(0, t('Home'), '', {
        choices: [
          [0, t('this position')],
          [1, t('current position')],
        ],
      }),
    ],
    { height: true },
  ),
  spec(
    CMD.ROI_LOCATION,
    t('Look at (ROI)'),
    'needed',
    [param(0, t('Gimbal, 0: all'), '', { least: 0, most: 255, whole: true })],
    {
      height: true,
    },
  ),
  spec(
    CMD.ROI,
    t('Look at (ROI, legacy)'),
    'here-if-none',
    [
      param(0, t('Target'), '', {
        choices: [
          [0, t('nothing')],
          [1, t('the next waypoint')],
          [2, t('a waypoint')],
          [3, t('a position')],
          [4, t('a target')],
        ],
        initial: 3,
      }),
      param(1, t('Waypoint or target'), '', { least: 0, most: 65_535, whole: true }),
      param(2, t('Index'), '', { least: 0, most: 255, whole: true }),
    ],
    { height: true },
  ),
  spec(CMD.ROI_NONE, t('Look ahead'), 'none', [
    param(0, t('Gimbal, 0: all'), '', { least: 0, most: 255, whole: true }),
  ]),
  spec(CMD.TRIGGER_DISTANCE, t('Camera trigger by distance'), 'none', [
    param(0, t('Distance, 0: stop'), 'm', { least: 0, most: 10_000, initial: 20 }),
    param(1, t('Shutter, milliseconds'), '', { least: -1, most: 60_000, mayBeOpen: true }),
    param(2, t('First photo at once'), '', {
      choices: [
        [0, t('no')],
        [1, t('yes')],
      ],
    }),
    param(3, t('Camera, 0: all'), '', { least: 0, most: 255, whole: true, mayBeOpen: true }),
  ]),
  // x triggers the picture.
  spec(CMD.CAMERA_SHOT, t('Take one photo'), 'none', [], { raw: { x: 1 } }),
  spec(CMD.IMAGE_START, t('Take photos'), 'none', [
    param(0, t('Camera, 0: all'), '', { least: 0, most: 255, whole: true }),
    param(1, t('Interval'), 's', { least: 0, most: 65_535 }),
    param(2, t('Count, 0: until stopped'), '', { least: 0, most: 65_535, whole: true, initial: 1 }),
    param(3, t('First number'), '', { least: 0, most: 65_535, whole: true, mayBeOpen: true }),
  ]),
  spec(CMD.IMAGE_STOP, t('Stop taking photos'), 'none', [
    param(0, t('Camera, 0: all'), '', { least: 0, most: 255, whole: true }),
  ]),
  spec(CMD.VIDEO_START, t('Record video'), 'none', [
    param(0, t('Stream, 0: all'), '', { least: 0, most: 255, whole: true }),
    param(1, t('Reports per second'), '', { least: 0, most: 100 }),
  ]),
  spec(CMD.VIDEO_STOP, t('Stop recording'), 'none', [
    param(0, t('Stream, 0: all'), '', { least: 0, most: 255, whole: true }),
  ]),
  spec(
    CMD.MOUNT_CONTROL,
    t('Gimbal (legacy)'),
    'none',
    [
      param(0, t('Pitch'), 'deg', { least: -180, most: 180 }),
      param(1, t('Roll'), 'deg', { least: -180, most: 180 }),
      param(2, t('Yaw'), 'deg', { least: -360, most: 360 }),
    ],
    // MAV_MOUNT_MODE: by these angles.
    { raw: { z: 2 } },
  ),
  spec(CMD.GIMBAL_PITCH_YAW, t('Gimbal'), 'none', [
    param(0, t('Pitch'), 'deg', { least: -180, most: 180, mayBeOpen: true }),
    param(1, t('Yaw'), 'deg', { least: -360, most: 360, mayBeOpen: true }),
    param(2, t('Pitch rate'), 'deg/s', { least: -360, most: 360, mayBeOpen: true }),
    param(3, t('Yaw rate'), 'deg/s', { least: -360, most: 360, mayBeOpen: true }),
  ]),
  spec(CMD.SET_SERVO, t('Servo'), 'none', [
    param(0, t('Servo'), '', { least: 1, most: 32, whole: true, initial: 9 }),
    param(1, t('Pulse'), 'us', { least: 0, most: 3_000, whole: true, initial: 1_500 }),
  ]),
  spec(CMD.SET_RELAY, t('Relay'), 'none', [
    param(0, t('Relay'), '', { least: 0, most: 15, whole: true }),
    param(1, t('Switch'), '', {
      choices: [
        [0, t('off')],
        [1, t('on')],
      ],
    }),
  ]),
  spec(CMD.GRIPPER, t('Gripper'), 'none', [
    param(0, t('Gripper'), '', { least: 0, most: 6, whole: true, initial: 1 }),
    param(1, t('Action'), '', {
      choices: [
        [0, t('release')],
        [1, t('grab')],
      ],
    }),
  ]),
  spec(CMD.LAND_START, t('Landing sequence'), 'here-if-none', [], { height: true }),
  spec(3000, t('VTOL transition'), 'none', [
    param(0, t('To'), '', {
      choices: [
        [3, t('hovering')],
        [4, t('forward flight')],
      ],
      initial: 4,
    }),
  ]),
];

export const CATALOGUE: ReadonlyMap<number, CommandSpec> = new Map(SPECS.map((one) => [one.command, one]));

export const specOf = (command: number): CommandSpec | null => CATALOGUE.get(command) ?? null;

const has = (commands: readonly number[], command: number): boolean => commands.includes(command);

/** Whether this autopilot carries it out in a mission. */
export const isKnownTo = ({ command }: CommandSpec, autopilot: AutopilotKind): boolean =>
  !has(FAMILIES[autopilot].lacks, command);

/** Whether it is offered in a plan for this autopilot. */
export const isOffered = (
  spec: CommandSpec,
  autopilot: AutopilotKind,
  lacks: ReadonlySet<number> = new Set(),
): boolean => isKnownTo(spec, autopilot) && !has(FAMILIES[autopilot].hides, spec.command) && !lacks.has(spec.command);

/** Whether this autopilot accepts the parameter of a command unset. */
export const isOpenTo = (command: number, { at, mayBeOpen }: ParamSpec, autopilot: AutopilotKind): boolean => {
  const requires: Readonly<Record<number, readonly number[]>> = FAMILIES[autopilot].requires;
  return mayBeOpen === true && !requires[command]?.includes(at);
};

export const commandWords = (command: number): string => specOf(command)?.label ?? t('Command {command}', { command });

/** The drone flies somewhere or does something that takes time: not a side command. */
export const isNavigation = (command: number): boolean => command < 95;
