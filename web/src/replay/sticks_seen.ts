/** The sticks as they passed the tower, from frames on their way to the drone: MANUAL_CONTROL, or RC_CHANNELS_OVERRIDE. */

import type { Message } from '../link/mavlink';
import type { Axes } from '../link/sticks';

/** Sticks come some twenty times a second; without any for this long nobody moves them. */
const OLD_AFTER_MS = 1_000;
const MIDDLE_US = 1_500;
const HALF_US = 500;
const NOT_SENT = 0x7fff;

export class SticksSeen {
  #axes: Axes | null = null;
  #atMs = -Infinity;

  receive(message: Message, atMs: number): void {
    const axes = axesOf(message);
    if (!axes) return;
    this.#axes = axes;
    this.#atMs = atMs;
  }

  /** Null: no sticks at this time. */
  at(nowMs: number): Axes | null {
    return nowMs - this.#atMs <= OLD_AFTER_MS ? this.#axes : null;
  }
}

function axesOf(message: Message): Axes | null {
  if (message.name === 'MANUAL_CONTROL') {
    const { x, y, z, r } = message.fields;
    const share = (value: number): number => (value === NOT_SENT ? 0 : limited(value / 1000));
    return { pitch: share(x), roll: share(y), throttle: z === NOT_SENT ? 0 : limited(z / 500 - 1), yaw: share(r) };
  }
  if (message.name === 'RC_CHANNELS_OVERRIDE') {
    const { chan1_raw: roll, chan2_raw: pitch, chan3_raw: throttle, chan4_raw: yaw } = message.fields;
    const share = (us: number): number => (us === 0 || us === 0xffff ? 0 : limited((us - MIDDLE_US) / HALF_US));
    // Of a receiver's channel 2 a low value is forward.
    return { roll: share(roll), pitch: -share(pitch), throttle: share(throttle), yaw: share(yaw) };
  }
  return null;
}

const limited = (value: number): number => Math.max(-1, Math.min(1, value));
