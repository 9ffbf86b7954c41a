/** Binary messages of /live: `tag (drone id, u32 little endian) + one whole MAVLink frame`, end to end. */

import { frameLengthAt } from './mavlink';

const TAG_LENGTH = 4;

export interface TaggedFrame {
  readonly droneId: number;
  readonly frame: Uint8Array;
}

/** The frames of one message, in order. Null when it does not parse to its last byte: then none of it is used. */
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

export function tag(droneId: number, frame: Uint8Array): Uint8Array<ArrayBuffer> {
  const message = new Uint8Array(TAG_LENGTH + frame.length);
  new DataView(message.buffer).setUint32(0, droneId, true);
  message.set(frame, TAG_LENGTH);
  return message;
}
