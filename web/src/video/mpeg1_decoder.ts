/**
 * Drives the MPEG-1 decoder of JSMpeg (WebAssembly): takes the elementary stream of one picture, returns its planes at
 * once.
 *
 * The decoder reads a sequence header only once, and a second decoder in the same memory starts with leftovers of the
 * first. So each has its own memory, and a stream of another size gets a new one.
 */

import type { Planes } from './screen';

const PAGE_BYTES = 64 * 1024;
const FIRST_PAGES = 256;
/** As the binary was built; its stack follows its own data. */
const STACK_BYTES = 5 * 1024 * 1024;
const ALIGN_BYTES = 16;
/** Larger than the largest unit; drops older pictures when it is full. */
const BUFFER_BYTES = 512 * 1024;
const EVICT = 1;
const HEADER_CODE = 0xb3;
/** Ends the last slice: without it the decoder would search older bytes for the next start code. */
const SEQUENCE_END = Uint8Array.of(0, 0, 1, 0xb7);
/** A decoder that needs more than this received invalid data. */
const MAX_BYTES = 64 * 1024 * 1024;

interface Exports {
  __post_instantiate?: () => void;
  _mpeg1_decoder_create(bytes: number, mode: number): number;
  _mpeg1_decoder_get_write_ptr(decoder: number, bytes: number): number;
  _mpeg1_decoder_did_write(decoder: number, bytes: number): void;
  _mpeg1_decoder_decode(decoder: number): number;
  _mpeg1_decoder_has_sequence_header(decoder: number): number;
  _mpeg1_decoder_get_width(decoder: number): number;
  _mpeg1_decoder_get_height(decoder: number): number;
  _mpeg1_decoder_get_y_ptr(decoder: number): number;
  _mpeg1_decoder_get_cr_ptr(decoder: number): number;
  _mpeg1_decoder_get_cb_ptr(decoder: number): number;
}

/** One decoder in its own memory. */
class Instance {
  readonly #memory = new WebAssembly.Memory({ initial: FIRST_PAGES });
  readonly #call: Exports;
  readonly #decoder: number;
  #end: number;

  constructor(module: WebAssembly.Module) {
    this.#end = staticBytes(module) + STACK_BYTES;
    const instance = new WebAssembly.Instance(module, {
      env: {
        memory: this.#memory,
        __memory_base: 0,
        _sbrk: (bytes: number) => this.#grow(bytes),
        ___assert_fail: () => {
          throw new Error('the decoder found itself broken');
        },
      },
    });
    this.#call = instance.exports as unknown as Exports;
    this.#call.__post_instantiate?.();
    this.#decoder = this.#call._mpeg1_decoder_create(BUFFER_BYTES, EVICT);
  }

  /** Null if the bytes are not a picture. Throws WebAssembly.RuntimeError for some invalid data. */
  decode(pieces: readonly Uint8Array[]): Planes | null {
    const bytes = pieces.reduce((sum, piece) => sum + piece.length, SEQUENCE_END.length);
    let at = this.#call._mpeg1_decoder_get_write_ptr(this.#decoder, bytes);
    const memory = new Uint8Array(this.#memory.buffer);
    for (const piece of [...pieces, SEQUENCE_END]) {
      memory.set(piece, at);
      at += piece.length;
    }
    this.#call._mpeg1_decoder_did_write(this.#decoder, bytes);
    if (!this.#call._mpeg1_decoder_has_sequence_header(this.#decoder)) return null;
    return this.#call._mpeg1_decoder_decode(this.#decoder) ? this.#planes() : null;
  }

  #planes(): Planes {
    const call = this.#call;
    const width = call._mpeg1_decoder_get_width(this.#decoder);
    const height = call._mpeg1_decoder_get_height(this.#decoder);
    const codedWidth = (width + 15) & ~15;
    const codedHeight = (height + 15) & ~15;
    const pixels = codedWidth * codedHeight;
    const plane = (at: number, bytes: number): Uint8Array => new Uint8Array(this.#memory.buffer, at, bytes);
    return {
      width,
      height,
      codedWidth,
      codedHeight,
      y: plane(call._mpeg1_decoder_get_y_ptr(this.#decoder), pixels),
      cb: plane(call._mpeg1_decoder_get_cb_ptr(this.#decoder), pixels / 4),
      cr: plane(call._mpeg1_decoder_get_cr_ptr(this.#decoder), pixels / 4),
    };
  }

  #grow(bytes: number): number {
    const before = this.#end;
    this.#end += bytes;
    if (this.#end > MAX_BYTES) throw new RangeError('the decoder wants too much memory');
    const missing = this.#end - this.#memory.buffer.byteLength;
    if (missing > 0) this.#memory.grow(Math.ceil(missing / PAGE_BYTES));
    return before;
  }
}

export class Mpeg1Decoder {
  readonly #module: WebAssembly.Module;
  #instance: Instance | null = null;
  #shape = '';

  constructor(module: WebAssembly.Module) {
    this.#module = module;
  }

  /**
   * `pieces`: the elementary stream of one picture; the first one begins with a sequence header. The planes are in the
   * decoder's own memory: valid until the next call. Null if the bytes are not a picture.
   */
  decode(pieces: readonly Uint8Array[]): Planes | null {
    const [first] = pieces;
    if (!first) return null;
    const shape = shapeOf(first);
    if (shape !== null && shape !== this.#shape) {
      this.#instance = new Instance(this.#module);
      this.#shape = shape;
    }
    if (!this.#instance) return null;
    try {
      return this.#instance.decode(pieces);
    } catch {
      // Its memory can no longer be trusted.
      this.#instance = null;
      this.#shape = '';
      return null;
    }
  }
}

/** The values of a sequence header that a decoder cannot change: size and matrices. Null: no header. */
function shapeOf(piece: Uint8Array): string | null {
  const [a, b, c, code] = piece;
  if (a !== 0 || b !== 0 || c !== 1 || code !== HEADER_CODE || piece.length < 12) return null;
  const hasMatrices = (piece[11] ?? 0) & 3;
  return [...piece.subarray(4, 7), hasMatrices, ...(hasMatrices ? piece.subarray(12, 140) : [])].join();
}

/** The end of the binary's own data. */
function staticBytes(module: WebAssembly.Module): number {
  const [section] = WebAssembly.Module.customSections(module, 'dylink');
  if (!section) throw new Error('the MPEG-1 decoder is not built as expected');
  let bytes = 0;
  const read = new Uint8Array(section);
  for (let at = 0, unit = 1; at < read.length; at++, unit *= 128) {
    const byte = read[at] ?? 0;
    bytes += (byte & 0x7f) * unit;
    if (byte < 0x80) break;
  }
  return Math.ceil(bytes / ALIGN_BYTES) * ALIGN_BYTES;
}
