/** Numbers of one field out of frames, without decoding the rest of the message; and fewer of them for the screen. */

import { SIZE_OF, readNumber, type Field } from '../link/field_types';
import type { FrameLog } from './frame_log';

/** One number of a message: `index` in an array field. */
export type FieldReader = (bytes: Uint8Array, at: number) => number;

const scratch = new DataView(new ArrayBuffer(8));
const HEADER_V1 = 6;
const HEADER_V2 = 10;

export const isNumeric = ({ type }: Field): boolean => type !== 'c8';

/** `at`: where the frame begins. Zeros that version 2 cuts off are read as zeros. */
export function fieldReader(field: Field, index = 0): FieldReader {
  const { type } = field;
  const size = SIZE_OF[type];
  const offset = field.offset + index * size;
  let view: DataView<ArrayBufferLike> = new DataView(new ArrayBuffer(0));
  return (bytes, at) => {
    const header = bytes[at] === 0xfd ? HEADER_V2 : HEADER_V1;
    const present = bytes[at + 1]!;
    if (offset + size <= present) {
      if (view.buffer !== bytes.buffer) view = new DataView(bytes.buffer);
      return Number(readNumber(view, type, bytes.byteOffset + at + header + offset));
    }
    for (let byte = 0; byte < size; byte++) {
      scratch.setUint8(byte, offset + byte < present ? bytes[at + header + offset + byte]! : 0);
    }
    return Number(readNumber(scratch, type, 0));
  };
}

/** Times in milliseconds since 1970, and values. */
export interface Series {
  readonly times: Float64Array<ArrayBuffer>;
  readonly values: Float64Array<ArrayBuffer>;
}

/** Every value of the field between two times, thinned to about `maxPoints`. */
export function seriesOf(
  log: FrameLog,
  kind: number,
  read: FieldReader,
  fromMs: number,
  toMs: number,
  maxPoints: number,
): Series {
  const from = log.entryAt(fromMs);
  const to = log.entryAt(toMs + 1);
  let count = 0;
  log.each(kind, from, to, () => (count += 1));
  const kept = new Thinning(count, maxPoints);
  log.each(kind, from, to, (atMs, bytes, at) => kept.push(atMs, read(bytes, at)));
  return kept.series;
}

/** Of each stretch the least and the greatest value, so that no peak is lost. */
export function thinned(times: ArrayLike<number>, values: ArrayLike<number>, maxPoints: number): Series {
  const kept = new Thinning(times.length, maxPoints);
  for (let at = 0; at < times.length; at++) kept.push(times[at]!, values[at]!);
  return kept.series;
}

class Extreme {
  at = 0;
  atMs = 0;
  value = 0;

  set(at: number, atMs: number, value: number): void {
    this.at = at;
    this.atMs = atMs;
    this.value = value;
  }
}

/** Takes the values one by one: lists of all those of a long flight would outlive their use by minutes. */
class Thinning {
  readonly #count: number;
  readonly #stretches: number;
  readonly #times: Float64Array<ArrayBuffer>;
  readonly #values: Float64Array<ArrayBuffer>;
  #kept = 0;
  #taken = 0;
  #stretch = 0;
  #nextAt = 0;
  readonly #least = new Extreme();
  readonly #greatest = new Extreme();

  /** `count`: how many values will come. */
  constructor(count: number, maxPoints: number) {
    this.#count = count;
    this.#stretches = count <= maxPoints ? 0 : Math.max(1, Math.floor(maxPoints / 2));
    const room = this.#stretches === 0 ? count : this.#stretches * 2;
    this.#times = new Float64Array(room);
    this.#values = new Float64Array(room);
  }

  push(atMs: number, value: number): void {
    const at = this.#taken++;
    if (this.#stretches === 0) this.#keep(atMs, value);
    else {
      if (at === this.#nextAt) {
        this.#endStretch();
        this.#stretch += 1;
        this.#nextAt = Math.floor((this.#stretch * this.#count) / this.#stretches);
        this.#least.set(at, atMs, value);
        this.#greatest.set(at, atMs, value);
      } else if (value < this.#least.value) this.#least.set(at, atMs, value);
      else if (value > this.#greatest.value) this.#greatest.set(at, atMs, value);
    }
  }

  get series(): Series {
    if (this.#taken > 0) this.#endStretch();
    return { times: this.#times.slice(0, this.#kept), values: this.#values.slice(0, this.#kept) };
  }

  #endStretch(): void {
    if (this.#stretch === 0) return;
    const [first, second] =
      this.#least.at <= this.#greatest.at ? [this.#least, this.#greatest] : [this.#greatest, this.#least];
    this.#keep(first.atMs, first.value);
    if (first.at !== second.at) this.#keep(second.atMs, second.value);
  }

  #keep(atMs: number, value: number): void {
    this.#times[this.#kept] = atMs;
    this.#values[this.#kept] = value;
    this.#kept += 1;
  }
}
