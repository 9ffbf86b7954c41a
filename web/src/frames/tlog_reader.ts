/**
 * Cuts a telemetry log (`.tlog`) into frames, piece by piece as it comes: before each frame 8 bytes, microseconds since
 * 1970 in big endian. Bytes that are no entry are skipped up to the next one that is: files of other programs have torn
 * places.
 */

import { crcAdd, crcOf } from '../link/crc';
import { frameLengthAt } from '../link/mavlink';
import { definitionOf } from './definitions';
import type { FrameLog } from './frame_log';

const STAMP_BYTES = 8;
const MAX_FRAME_BYTES = 280;
const MAX_ENTRY_BYTES = STAMP_BYTES + MAX_FRAME_BYTES;
/** 2001 to 2100, in seconds. */
const MIN_S = 1e9;
const MAX_S = 4.1e9;

export class TlogReader {
  readonly #log: FrameLog;
  #rest = new Uint8Array(0);
  /** Bytes that belong to no entry. */
  skipped = 0;

  constructor(log: FrameLog) {
    this.#log = log;
  }

  /** The next bytes of the file. */
  take(piece: Uint8Array): void {
    // Only the seam is joined: a copy of each piece would double what an hour leaves to the garbage.
    let begin = 0;
    if (this.#rest.length > 0) {
      const rest = this.#rest.length;
      const seam = joined(this.#rest, piece.subarray(0, MAX_ENTRY_BYTES));
      const stopped = this.#read(seam, 0, Math.min(rest, seam.length - MAX_ENTRY_BYTES));
      if (stopped < rest) {
        this.#rest = joined(this.#rest.subarray(stopped), piece);
        return; // a piece that is shorter than an entry
      }
      begin = stopped - rest;
    }
    this.#rest = piece.slice(this.#read(piece, begin, piece.length - MAX_ENTRY_BYTES));
  }

  /** Nothing follows. */
  end(): void {
    this.#read(this.#rest, 0, this.#rest.length);
    this.#rest = new Uint8Array(0);
  }

  /** Entries from `begin` on that begin before `limit`; returns where it stopped. */
  #read(bytes: Uint8Array, begin: number, limit: number): number {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = begin;
    while (at < limit) {
      const length = entryLength(bytes, view, at);
      if (length === null) {
        at += 1;
        this.skipped += 1;
        continue;
      }
      const atMs = view.getUint32(at) * 4_294_967.296 + view.getUint32(at + 4) / 1000;
      this.#log.push(atMs, bytes, at + STAMP_BYTES, length);
      at += STAMP_BYTES + length;
    }
    return at;
  }
}

/** The length of the frame behind the time at `at`; null: there is no entry. */
function entryLength(bytes: Uint8Array, view: DataView, at: number): number | null {
  if (bytes.length - at <= STAMP_BYTES) return null;
  const seconds = view.getUint32(at) * 4294.967296;
  if (seconds < MIN_S || seconds > MAX_S) return null;
  const begin = at + STAMP_BYTES;
  const length = frameLengthAt(bytes, begin);
  if (length === null) return null;
  const isV2 = bytes[begin] === 0xfd;
  const msgid = isV2 ? bytes[begin + 7]! | (bytes[begin + 8]! << 8) | (bytes[begin + 9]! << 16) : bytes[begin + 5]!;
  const definition = definitionOf(msgid);
  if (!definition) return length; // another dialect: only its length is known
  const end = begin + (isV2 ? 10 : 6) + bytes[begin + 1]!;
  const crc = crcAdd(crcOf(bytes, begin + 1, end), definition.crcExtra);
  return bytes[end] === (crc & 0xff) && bytes[end + 1] === crc >>> 8 ? length : null;
}

function joined(one: Uint8Array, other: Uint8Array): Uint8Array<ArrayBuffer> {
  const whole = new Uint8Array(one.length + other.length);
  whole.set(one);
  whole.set(other, one.length);
  return whole;
}
