/**
 * Frames with their times, in order, as bytes: a flight of an hour is some 13 MB here, and would be ten times that as
 * decoded objects. Without bounds it holds a recorded flight; with bounds it is a ring of the newest.
 */

/** Messages of one kind from one component. */
export interface FrameKind {
  readonly sysid: number;
  readonly compid: number;
  readonly msgid: number;
  count: number;
  /** The entry that came last. */
  last: number;
}

interface Chunk {
  bytes: Uint8Array;
  used: number;
  /** The number of its first entry. */
  readonly first: number;
  count: number;
  times: Float64Array;
  starts: Uint32Array;
  lengths: Uint16Array;
  kinds: Uint16Array;
}

export interface FrameLogBounds {
  readonly maxMs: number;
  readonly maxBytes: number;
}

const CHUNK_ENTRIES = 2048;
const CHUNK_BYTES = 128 * 1024;
/** Beside the bytes: time, start, length and kind. */
const ENTRY_BYTES = 16;
/** A sender that makes up addresses does not fill the memory. */
const MAX_KINDS = 4096;

export class FrameLog {
  readonly kinds: FrameKind[] = [];
  readonly #bounds: FrameLogBounds | null;
  readonly #chunks: Chunk[] = [];
  readonly #kindOf = new Map<number, Map<number, number>>();
  #count = 0;
  #lastMs = -Infinity;

  constructor(bounds: FrameLogBounds | null = null) {
    this.#bounds = bounds;
  }

  /** The number of the next entry. Numbers are kept when old entries are dropped. */
  get end(): number {
    return this.#count;
  }

  /** The number of the oldest entry that is kept. */
  get begin(): number {
    return this.#chunks[0]?.first ?? this.#count;
  }

  get firstMs(): number | null {
    const chunk = this.#chunks[0];
    return chunk && chunk.count > 0 ? chunk.times[0]! : null;
  }

  get lastMs(): number | null {
    return this.#count === this.begin ? null : this.#lastMs;
  }

  /** The memory it takes. */
  get bytes(): number {
    return this.#chunks.reduce((sum, { bytes, times }) => sum + bytes.length + times.length * ENTRY_BYTES, 0);
  }

  /** `length` bytes from `at` are one whole frame. Time never goes back: a clock that was set does not break the order. */
  push(atMs: number, bytes: Uint8Array, at: number, length: number): void {
    const isV2 = bytes[at] === 0xfd;
    const msgid = isV2 ? bytes[at + 7]! | (bytes[at + 8]! << 8) | (bytes[at + 9]! << 16) : bytes[at + 5]!;
    const kind = this.#kind(bytes[at + (isV2 ? 5 : 3)]!, bytes[at + (isV2 ? 6 : 4)]!, msgid);
    if (kind < 0) return;
    const chunk = this.#chunkFor(length);
    this.#lastMs = Math.max(this.#lastMs, atMs);
    // A view for each frame would be garbage of more bytes than the frame has.
    const { bytes: kept, used } = chunk;
    for (let byte = 0; byte < length; byte++) kept[used + byte] = bytes[at + byte]!;
    chunk.times[chunk.count] = this.#lastMs;
    chunk.starts[chunk.count] = chunk.used;
    chunk.lengths[chunk.count] = length;
    chunk.kinds[chunk.count] = kind;
    chunk.count += 1;
    chunk.used += length;
    const entry = this.kinds[kind]!;
    entry.count += 1;
    entry.last = this.#count;
    this.#count += 1;
  }

  timeOf(entry: number): number {
    const chunk = this.#chunkOf(entry);
    return chunk.times[entry - chunk.first]!;
  }

  kindOf(entry: number): number {
    const chunk = this.#chunkOf(entry);
    return chunk.kinds[entry - chunk.first]!;
  }

  /** A view, not a copy: it is good until the next `push`. */
  frameOf(entry: number): Uint8Array {
    const chunk = this.#chunkOf(entry);
    const at = entry - chunk.first;
    const start = chunk.starts[at]!;
    return chunk.bytes.subarray(start, start + chunk.lengths[at]!);
  }

  /** Calls back with the bytes of neighbours, chunk by chunk: copying them so costs no object for each frame. */
  eachRun(
    from: number,
    to: number,
    visit: (bytes: Uint8Array, lengths: Uint16Array, times: Float64Array) => void,
  ): void {
    for (const chunk of this.#chunks) {
      const first = Math.max(0, from - chunk.first);
      const last = Math.min(chunk.count, to - chunk.first);
      if (first >= last) continue;
      const end = chunk.starts[last - 1]! + chunk.lengths[last - 1]!;
      const bytes = chunk.bytes.subarray(chunk.starts[first]!, end);
      visit(bytes, chunk.lengths.subarray(first, last), chunk.times.subarray(first, last));
    }
  }

  /** The first entry at this time or later. */
  entryAt(atMs: number): number {
    let low = this.begin;
    let high = this.#count;
    while (low < high) {
      const middle = (low + high) >>> 1;
      if (this.timeOf(middle) < atMs) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Calls back for each entry of one kind, in order. `from`, `to`: numbers of entries. */
  each(kind: number, from: number, to: number, visit: (atMs: number, bytes: Uint8Array, at: number) => void): void {
    for (const chunk of this.#chunks) {
      if (chunk.first + chunk.count <= from) continue;
      if (chunk.first >= to) return;
      const last = Math.min(chunk.count, to - chunk.first);
      for (let at = Math.max(0, from - chunk.first); at < last; at++) {
        if (chunk.kinds[at] === kind) visit(chunk.times[at]!, chunk.bytes, chunk.starts[at]!);
      }
    }
  }

  /** Calls back for each entry from this number on, in order. */
  eachFrom(
    from: number,
    visit: (kind: number, atMs: number, bytes: Uint8Array, at: number, length: number) => void,
  ): void {
    for (const { first, count, kinds, times, bytes, starts, lengths } of this.#chunks) {
      for (let at = Math.max(0, from - first); at < count; at++) {
        visit(kinds[at]!, times[at]!, bytes, starts[at]!, lengths[at]!);
      }
    }
  }

  #kind(sysid: number, compid: number, msgid: number): number {
    // Of two small numbers: a larger key would be an object for each frame.
    const sender = sysid * 256 + compid;
    let kindOf = this.#kindOf.get(sender);
    const known = kindOf?.get(msgid);
    if (known !== undefined) return known;
    if (this.kinds.length >= MAX_KINDS) return -1;
    if (!kindOf) this.#kindOf.set(sender, (kindOf = new Map()));
    this.kinds.push({ sysid, compid, msgid, count: 0, last: -1 });
    kindOf.set(msgid, this.kinds.length - 1);
    return this.kinds.length - 1;
  }

  #chunkFor(length: number): Chunk {
    const last = this.#chunks.at(-1);
    if (last && last.count < CHUNK_ENTRIES && last.used + length <= last.bytes.length) return last;
    const bytes = last ? trim(last) : new Uint8Array(CHUNK_BYTES);
    const chunk: Chunk = {
      bytes,
      used: 0,
      first: this.#count,
      count: 0,
      times: new Float64Array(CHUNK_ENTRIES),
      starts: new Uint32Array(CHUNK_ENTRIES),
      lengths: new Uint16Array(CHUNK_ENTRIES),
      kinds: new Uint16Array(CHUNK_ENTRIES),
    };
    this.#chunks.push(chunk);
    this.#forget();
    return chunk;
  }

  #forget(): void {
    if (!this.#bounds) return;
    const { maxMs, maxBytes } = this.#bounds;
    while (this.#chunks.length > 2) {
      const oldest = this.#chunks[0]!;
      const isOld = oldest.times[oldest.count - 1]! < this.#lastMs - maxMs;
      if (!isOld && this.bytes <= maxBytes) return;
      this.#chunks.shift();
    }
  }

  #chunkOf(entry: number): Chunk {
    let low = 0;
    let high = this.#chunks.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >>> 1;
      if (this.#chunks[middle]!.first <= entry) low = middle;
      else high = middle - 1;
    }
    return this.#chunks[low]!;
  }
}

/** A chunk that is full keeps what it uses. Returns its large buffer for the next one: left to the garbage, those of an
 * hour are as large as the flight. */
function trim(chunk: Chunk): Uint8Array {
  const large = chunk.bytes;
  chunk.bytes = large.slice(0, chunk.used);
  if (chunk.count === chunk.times.length) return large;
  chunk.times = chunk.times.slice(0, chunk.count);
  chunk.starts = chunk.starts.slice(0, chunk.count);
  chunk.lengths = chunk.lengths.slice(0, chunk.count);
  chunk.kinds = chunk.kinds.slice(0, chunk.count);
  return large;
}
