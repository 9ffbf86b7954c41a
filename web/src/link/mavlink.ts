/**
 * MAVLink frames: finds them in bytes, decodes, encodes. Reads version 1 and version 2, signed or not (the signature is
 * kept but not checked: that is the autopilot's task); writes version 2, unsigned, trailing zeros cut.
 *
 * Nothing here throws on external bytes.
 */

import { CRC_START, crcAdd, crcOf } from './crc';
import type { MessageFields, MessageName } from './generated/mavlink.gen';
import { definitionById, definitionByName, readField, writeField, type FieldValue } from './mavlink_fields';

const STX_V1 = 0xfe;
const STX_V2 = 0xfd;
const HEADER_V1 = 6;
const HEADER_V2 = 10;
const CHECKSUM_LENGTH = 2;
const SIGNATURE_LENGTH = 13;
const FLAG_SIGNED = 0x01;
const MAX_PAYLOAD_LENGTH = 255;

export interface Header {
  readonly version: 1 | 2;
  readonly signed: boolean;
  readonly seq: number;
  readonly sysid: number;
  readonly compid: number;
  readonly msgid: number;
}

/** A decoded frame; `name` determines the fields. */
export type Message = {
  [N in MessageName]: { readonly name: N; readonly header: Header; readonly fields: MessageFields[N] };
}[MessageName];

/** The length of the frame that begins at `at`, or null without a whole frame. */
export function frameLengthAt(bytes: Uint8Array, at: number): number | null {
  const left = bytes.length - at;
  if (left < HEADER_V1 + CHECKSUM_LENGTH) return null;
  let length: number;
  if (bytes[at] === STX_V1) {
    length = HEADER_V1 + bytes[at + 1]! + CHECKSUM_LENGTH;
  } else if (bytes[at] === STX_V2) {
    const signature = bytes[at + 2]! & FLAG_SIGNED ? SIGNATURE_LENGTH : 0;
    length = HEADER_V2 + bytes[at + 1]! + CHECKSUM_LENGTH + signature;
  } else {
    return null;
  }
  return left >= length ? length : null;
}

/** One for all: a replay decodes a hundred thousand frames in a moment, and none of them leaves its bytes behind. */
const payload = new Uint8Array(MAX_PAYLOAD_LENGTH);
const payloadView = new DataView(payload.buffer);

/** Decodes one whole frame; null for an unknown message, a wrong checksum, or no frame at all. */
export function decode(frame: Uint8Array): Message | null {
  if (frameLengthAt(frame, 0) !== frame.length) return null;
  const isV2 = frame[0] === STX_V2;
  const headerLength = isV2 ? HEADER_V2 : HEADER_V1;
  const payloadLength = frame[1]!;
  const msgid = isV2 ? frame[7]! | (frame[8]! << 8) | (frame[9]! << 16) : frame[5]!;
  const definition = definitionById.get(msgid);
  if (!definition) return null;

  const end = headerLength + payloadLength;
  const crc = crcAdd(crcOf(frame, 1, end), definition.crcExtra);
  if (frame[end] !== (crc & 0xff) || frame[end + 1] !== crc >>> 8) return null;

  // Restores zeros that were cut off; ignores fields newer than our tables. What is read out of it is a copy.
  const present = Math.min(payloadLength, definition.size);
  payload.set(frame.subarray(headerLength, headerLength + present));
  payload.fill(0, present, definition.size);
  const fields: Record<string, FieldValue> = {};
  for (const field of definition.fields) fields[field.name] = readField(payloadView, field);
  const header: Header = {
    version: isV2 ? 2 : 1,
    signed: isV2 && (frame[2]! & FLAG_SIGNED) !== 0,
    seq: frame[isV2 ? 4 : 2]!,
    sysid: frame[isV2 ? 5 : 3]!,
    compid: frame[isV2 ? 6 : 4]!,
    msgid,
  };
  return { name: definition.name, header, fields } as unknown as Message;
}

export interface Sender {
  readonly sysid: number;
  readonly compid: number;
}

/** One MAVLink 2 frame. Fields left out are zero. */
export function encode<N extends MessageName>(
  name: N,
  fields: Partial<MessageFields[N]>,
  sender: Sender,
  seq: number,
): Uint8Array {
  const definition = definitionByName.get(name)!;
  const payload = new Uint8Array(definition.size);
  const view = new DataView(payload.buffer);
  for (const field of definition.fields) {
    const value = (fields as Record<string, FieldValue | undefined>)[field.name];
    if (value !== undefined) writeField(view, field, value);
  }
  // MAVLink 2 sends at least one byte, even if all are zero.
  let length = payload.length;
  while (length > 1 && payload[length - 1] === 0) length--;

  const end = HEADER_V2 + length;
  const frame = new Uint8Array(end + CHECKSUM_LENGTH);
  const { id } = definition;
  frame.set([STX_V2, length, 0, 0, seq & 0xff, sender.sysid, sender.compid, id & 0xff, (id >> 8) & 0xff, id >> 16]);
  frame.set(payload.subarray(0, length), HEADER_V2);
  const crc = crcAdd(crcOf(frame, 1, end, CRC_START), definition.crcExtra);
  frame[end] = crc & 0xff;
  frame[end + 1] = crc >>> 8;
  return frame;
}
