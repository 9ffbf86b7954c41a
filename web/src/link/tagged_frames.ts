/** Binary messages of /live: `tag (drone id, u32 little endian) + one whole MAVLink frame`, end to end. */

import { frameLengthAt } from './mavlink';

const TAG_LENGTH = 4;
/** No drone has this tag: our clock follows it instead of a frame. */
const NO_DRONE = 0;
const STAMP_LENGTH = 8;
const CLOCK_MODULO = 2 ** 32;

export interface TaggedFrame {
  readonly droneId: number;
  readonly frame: Uint8Array;
}

/** The frames of one message, in order. Null unless the whole message parses: then none of it is used. */
export function splitTagged(message: Uint8Array): TaggedFrame[] | null {
  const view = new DataView(message.buffer, message.byteOffset, message.byteLength);
  const frames: TaggedFrame[] = [];
  let at = 0;
  while (at < message.length) {
    const length = frameLengthAt(message, at + TAG_LENGTH);
    if (length === null) return null;
    const start = at + TAG_LENGTH;
    frames.push({ droneId: view.getUint32(at, true), frame: message.subarray(start, start + length) });
    at = start + length;
  }
  return frames;
}

/** `message` with our clock before it; the tower measures the delay with it. */
export function stamped(message: Uint8Array, monotonicMs: number): Uint8Array<ArrayBuffer> {
  const whole = new Uint8Array(STAMP_LENGTH + message.length);
  const view = new DataView(whole.buffer);
  view.setUint32(0, NO_DRONE, true);
  view.setUint32(TAG_LENGTH, Math.floor(monotonicMs) % CLOCK_MODULO, true);
  whole.set(message, STAMP_LENGTH);
  return whole;
}

export function tag(droneId: number, frame: Uint8Array): Uint8Array<ArrayBuffer> {
  const message = new Uint8Array(TAG_LENGTH + frame.length);
  new DataView(message.buffer).setUint32(0, droneId, true);
  message.set(frame, TAG_LENGTH);
  return message;
}
