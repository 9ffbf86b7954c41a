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
  const times: number[] = [];
  const values: number[] = [];
  log.each(kind, log.entryAt(fromMs), log.entryAt(toMs + 1), (atMs, bytes, at) => {
    times.push(atMs);
    values.push(read(bytes, at));
  });
  return thinned(times, values, maxPoints);
}

/** Of each stretch the least and the greatest value, so that no peak is lost. */
export function thinned(times: ArrayLike<number>, values: ArrayLike<number>, maxPoints: number): Series {
  const count = times.length;
  if (count <= maxPoints) return { times: Float64Array.from(times), values: Float64Array.from(values) };
  const stretches = Math.max(1, Math.floor(maxPoints / 2));
  const keptTimes = new Float64Array(stretches * 2);
  const keptValues = new Float64Array(stretches * 2);
  let kept = 0;
  for (let stretch = 0; stretch < stretches; stretch++) {
    const from = Math.floor((stretch * count) / stretches);
    const to = Math.floor(((stretch + 1) * count) / stretches);
    let least = from;
    let greatest = from;
    for (let at = from + 1; at < to; at++) {
      if (values[at]! < values[least]!) least = at;
      if (values[at]! > values[greatest]!) greatest = at;
    }
    for (const at of least < greatest ? [least, greatest] : least > greatest ? [greatest, least] : [least]) {
      keptTimes[kept] = times[at]!;
      keptValues[kept] = values[at]!;
      kept += 1;
    }
  }
  return { times: keptTimes.slice(0, kept), values: keptValues.slice(0, kept) };
}
