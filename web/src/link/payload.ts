/** What a drone carries, as far as it tells: gimbal and cameras by their heartbeats, gripper and servos by parameters. */

import { MAV_TYPE } from './generated/mavlink.gen';
import type { Message } from './mavlink';

const FIRST_CAMERA = 100;
const LAST_CAMERA = 105;
const GIMBAL_ATTITUDE = 'GIMBAL_DEVICE_ATTITUDE_STATUS';

export interface PayloadHeard {
  readonly hasGimbal: boolean;
  /** Numbers from 1, as in the commands. */
  readonly cameras: readonly number[];
}

export const NOTHING_HEARD: PayloadHeard = { hasGimbal: false, cameras: [] };

/** The same object if the message tells nothing new. */
export function heardIn(message: Message, before: PayloadHeard): PayloadHeard {
  const { compid } = message.header;
  const isBeat = message.name === 'HEARTBEAT';
  const isGimbal = message.name === GIMBAL_ATTITUDE || (isBeat && message.fields.type === MAV_TYPE.GIMBAL);
  if (isGimbal) return before.hasGimbal ? before : { ...before, hasGimbal: true };
  const isCamera = isBeat && message.fields.type === MAV_TYPE.CAMERA && compid >= FIRST_CAMERA && compid <= LAST_CAMERA;
  const camera = compid - FIRST_CAMERA + 1;
  if (!isCamera || before.cameras.includes(camera)) return before;
  return { ...before, cameras: [...before.cameras, camera].sort((a, b) => a - b) };
}

export interface PayloadSetUp {
  readonly hasGripper: boolean;
  /** Numbers of the servos that a command may move and that somebody has set up for it. */
  readonly servos: readonly number[];
}

export const NOTHING_SET_UP: PayloadSetUp = { hasGripper: false, servos: [] };

/** ArduPilot's SERVOn_FUNCTION of outputs for a pass-through, which a command moves too. */
const isPassThrough = (value: number): boolean => value === 1 || (value >= 51 && value <= 66);
/** PX4's output function "Peripheral via Actuator Set 1" to "6". */
const ACTUATOR_SET = 301;
const ACTUATORS = 6;

/** Reads it from the drone's parameters. */
export function setUpOf(rows: readonly { readonly name: string; readonly value: number }[]): PayloadSetUp {
  const servos = new Set<number>();
  let hasGripper = false;
  for (const { name, value } of rows) {
    if ((name === 'GRIP_ENABLE' || name === 'PD_GRIPPER_EN') && value === 1) hasGripper = true;
    const output = /^SERVO(\d+)_FUNCTION$/.exec(name)?.[1];
    if (output !== undefined && isPassThrough(value)) servos.add(Number(output));
    const actuator = value - ACTUATOR_SET + 1;
    if (/_FUNC\d+$/.test(name) && actuator >= 1 && actuator <= ACTUATORS) servos.add(actuator);
  }
  return { hasGripper, servos: [...servos].sort((a, b) => a - b) };
}
