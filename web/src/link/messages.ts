/** Everything the console sends, as pure builders: text for the tower, MAVLink commands for an autopilot. */

import { MAV_CMD, MAV_FRAME, type MessageFields } from './generated/mavlink.gen';

/** Who we are on the MAVLink network: a ground station, as autopilots expect it. */
export const CONSOLE = { sysid: 255, compid: 190 } as const;
export const AUTOPILOT_COMPID = 1;

/** param1 of DO_SET_MODE: MAV_MODE_FLAG_CUSTOM_MODE_ENABLED. */
const CUSTOM_MODE = 1;
/** param2 of COMPONENT_ARM_DISARM that overrides the autopilot's refusal to disarm in flight. */
const FORCE_DISARM = 21196;
const REPOSITION_CHANGES_MODE = 1;
const DEFAULT_SPEED = -1;

export const watchText = (rateHz: number): string => JSON.stringify({ type: 'watch', rate_hz: rateHz });
export const pongText = (sequence: number): string => JSON.stringify({ type: 'pong', sequence });
export const focusText = (droneId: number | null): string => JSON.stringify({ type: 'focus', drone_id: droneId });

/** What a map shows, in degrees. Longitudes may run beyond 180 either way, as a map that can be turned on and on has them. */
export interface MapBounds {
  readonly south: number;
  readonly west: number;
  readonly north: number;
  readonly east: number;
}

/** Of the map's width and height, on each side: a drone about to come into view is fresh already. */
const VIEWPORT_MARGIN = 0.2;

/** Tells the tower which drones may come less often; null: none. */
export function viewportText(shown: MapBounds | null): string {
  return JSON.stringify({ type: 'viewport', bounds: shown && widened(shown) });
}

function widened({ south, west, north, east }: MapBounds): MapBounds {
  const up = (north - south) * VIEWPORT_MARGIN;
  const aside = (east - west) * VIEWPORT_MARGIN;
  const lat = (deg: number): number => Math.max(-90, Math.min(90, deg));
  const isWholeTurn = east - west + 2 * aside >= 360;
  return {
    south: lat(south - up),
    west: isWholeTurn ? -180 : wrapped(west - aside),
    north: lat(north + up),
    east: isWholeTurn ? 180 : wrapped(east + aside),
  };
}

const wrapped = (lonDeg: number): number => ((((lonDeg + 180) % 360) + 360) % 360) - 180;

interface Common {
  readonly command: number;
  /** Whether it may be sent again when no answer comes. */
  readonly repeatable: boolean;
  /** A newer one may take the place of one that still waits: something else than the answer confirms it. */
  readonly replaces?: boolean;
}
export type Command =
  | (Common & { readonly form: 'COMMAND_LONG'; readonly fields: Partial<MessageFields['COMMAND_LONG']> })
  | (Common & { readonly form: 'COMMAND_INT'; readonly fields: Partial<MessageFields['COMMAND_INT']> });

type Params = readonly number[];

function long(command: number, params: Params, repeatable = true): Command {
  const [param1 = 0, param2 = 0, param3 = 0, param4 = 0, param5 = 0, param6 = 0, param7 = 0] = params;
  const fields = { command, param1, param2, param3, param4, param5, param6, param7 };
  return { form: 'COMMAND_LONG', command, repeatable, fields };
}

export const armCommand = (): Command => long(MAV_CMD.COMPONENT_ARM_DISARM, [1]);

export const disarmCommand = (evenInFlight: boolean): Command =>
  long(MAV_CMD.COMPONENT_ARM_DISARM, [0, evenInFlight ? FORCE_DISARM : 0]);

/** `main` and `sub` as the autopilot numbers its modes; sub is PX4's alone. */
export const setModeCommand = (main: number, sub = 0): Command => ({
  ...long(MAV_CMD.DO_SET_MODE, [CUSTOM_MODE, main, sub]),
  replaces: true,
});

/** Never repeated: an answer that was lost must not lead to a second take-off. */
export const takeOffCommand = (heightM: number): Command =>
  long(MAV_CMD.NAV_TAKEOFF, [0, 0, 0, 0, 0, 0, heightM], false);

export interface Place {
  readonly latDeg: number;
  readonly lonDeg: number;
}

export interface Target extends Place {
  /** Above home. */
  readonly altRelM: number;
}

/** `headingDeg`: which way it looks on the way and there; left out, the autopilot's own rule holds. */
export function goToCommand({ latDeg, lonDeg, altRelM }: Target, headingDeg: number | null = null): Command {
  const command = MAV_CMD.DO_REPOSITION;
  return {
    form: 'COMMAND_INT',
    command,
    repeatable: true,
    fields: {
      command,
      frame: MAV_FRAME.GLOBAL_RELATIVE_ALT,
      param1: DEFAULT_SPEED,
      param2: REPOSITION_CHANGES_MODE,
      param4: headingDeg === null ? NaN : (wrapped(headingDeg) * Math.PI) / 180,
      x: Math.round(latDeg * 1e7),
      y: Math.round(lonDeg * 1e7),
      z: altRelM,
    },
  };
}

/** Over the ground, in metres a second. */
export const changeSpeedCommand = (speedMps: number): Command => long(MAV_CMD.DO_CHANGE_SPEED, [1, speedMps, -1]);

/** 0..360, the short way round, as fast as the autopilot likes. */
export const turnToCommand = (headingDeg: number): Command => long(MAV_CMD.CONDITION_YAW, [headingDeg, 0, 0, 0]);

/** Home is where the drone is now. */
export const homeHereCommand = (): Command => long(MAV_CMD.DO_SET_HOME, [1]);

/** `altAmslM`: above mean sea level, as HOME_POSITION has it. */
export function homeAtCommand({ latDeg, lonDeg }: Place, altAmslM: number): Command {
  const command = MAV_CMD.DO_SET_HOME;
  const [x, y] = [Math.round(latDeg * 1e7), Math.round(lonDeg * 1e7)];
  return {
    form: 'COMMAND_INT',
    command,
    repeatable: true,
    fields: { command, frame: MAV_FRAME.GLOBAL, x, y, z: altAmslM },
  };
}
