/**
 * A recorded flight in pieces, as a film has key pictures: each piece begins with the newest message of each kind from
 * before it, so that any moment is shown after reading one piece. Scrubbing costs the same everywhere in a flight.
 */

import type { FrameLog } from '../frames/frame_log';

export const PIECE_MS = 4_000;
/** Decoding so many takes some 3 ms. */
export const MAX_PIECE_ENTRIES = 512;
const HEARTBEAT = 0;
const STATUSTEXT = 253;

/** Frames end to end. `ends[i]`: where frame i ends. */
export interface PackedFrames {
  readonly times: Float64Array<ArrayBuffer>;
  readonly ends: Uint32Array<ArrayBuffer>;
  readonly bytes: Uint8Array<ArrayBuffer>;
}

export interface Piece {
  readonly number: number;
  /** Good from here; until the next piece begins. */
  readonly fromMs: number;
  readonly toMs: number;
  /** The newest of each kind before it, in order of time; heartbeats before, too: they say who the autopilot is. */
  readonly before: PackedFrames;
  readonly frames: PackedFrames;
}

export class KeyFrames {
  readonly #log: FrameLog;
  /** The first entry of each piece. */
  readonly #begins: number[] = [];
  /** For each piece, by kind, the newest entry before it; -1: none. */
  readonly #before: Int32Array[] = [];
  readonly #newest: number[] = [];
  #beganMs = -Infinity;
  #read = 0;

  constructor(log: FrameLog) {
    this.#log = log;
  }

  /** Begin times of the pieces so far. */
  get begins(): number[] {
    return this.#begins.map((entry) => this.#log.timeOf(entry));
  }

  /** Reads what has come into the log. */
  update(): void {
    const log = this.#log;
    for (; this.#read < log.end; this.#read++) {
      const entry = this.#read;
      const atMs = log.timeOf(entry);
      const begun = this.#begins.at(-1);
      if (begun === undefined || atMs - this.#beganMs >= PIECE_MS || entry - begun >= MAX_PIECE_ENTRIES) {
        this.#begins.push(entry);
        this.#before.push(Int32Array.from(log.kinds, (_, kind) => this.#newest[kind] ?? -1));
        this.#beganMs = atMs;
      }
      this.#newest[log.kindOf(entry)] = entry;
    }
  }

  piece(number: number): Piece | null {
    const begin = this.#begins[number];
    const before = this.#before[number];
    if (begin === undefined || before === undefined) return null;
    const end = this.#begins[number + 1] ?? this.#log.end;
    const { kinds } = this.#log;
    const snapshot = [...before]
      .filter((entry, kind) => entry >= 0 && kinds[kind]!.msgid !== STATUSTEXT)
      .sort((one, other) => one - other);
    return {
      number,
      fromMs: this.#log.timeOf(begin),
      toMs: end < this.#log.end ? this.#log.timeOf(end) : Infinity,
      before: this.#packed([...snapshot.filter((entry) => this.#isHeartbeat(entry)), ...snapshot]),
      frames: this.#run(begin, end),
    };
  }

  #isHeartbeat(entry: number): boolean {
    return this.#log.kinds[this.#log.kindOf(entry)]!.msgid === HEARTBEAT;
  }

  /** Neighbours, which lie end to end already. */
  #run(begin: number, end: number): PackedFrames {
    const times = new Float64Array(end - begin);
    const ends = new Uint32Array(end - begin);
    let total = 0;
    this.#log.eachRun(begin, end, (bytes) => (total += bytes.length));
    const packed = { times, ends, bytes: new Uint8Array(total) };
    let at = 0;
    let filled = 0;
    this.#log.eachRun(begin, end, (bytes, lengths, runTimes) => {
      packed.bytes.set(bytes, filled);
      times.set(runTimes, at);
      for (const length of lengths) ends[at++] = filled += length;
    });
    return packed;
  }

  #packed(entries: readonly number[]): PackedFrames {
    const frames = entries.map((entry) => this.#log.frameOf(entry));
    const ends = new Uint32Array(entries.length);
    let total = 0;
    frames.forEach((frame, at) => (ends[at] = total += frame.length));
    const bytes = new Uint8Array(total);
    frames.forEach((frame, at) => bytes.set(frame, ends[at]! - frame.length));
    return { times: Float64Array.from(entries, (entry) => this.#log.timeOf(entry)), ends, bytes };
  }
}

/** The piece that shows this time; the first one for an earlier time. `begins`: of all pieces. */
export function pieceAt(begins: readonly number[], atMs: number): number {
  let low = 0;
  let high = begins.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >>> 1;
    if (begins[middle]! <= atMs) low = middle;
    else high = middle - 1;
  }
  return low;
}

export const frameOf = ({ ends, bytes }: PackedFrames, at: number): Uint8Array =>
  bytes.subarray(at === 0 ? 0 : ends[at - 1], ends[at]);
