/** The generated message tables, prepared for reading and writing payloads with a DataView. */

import { SIZE_OF, readFields, readNumber, type Field, type FieldType } from './field_types';
import { MESSAGES, type MessageName } from './generated/mavlink.gen';

export type FieldValue = number | bigint | string | number[] | bigint[];

export interface MessageDefinition {
  readonly id: number;
  readonly name: MessageName;
  readonly crcExtra: number;
  readonly fields: readonly Field[];
  /** Length of the whole payload with its extension fields, before zeros are cut off. */
  readonly size: number;
}

function define([id, name, crcExtra, spec]: readonly [number, string, number, string]): MessageDefinition {
  return { id, name: name as MessageName, crcExtra, ...readFields(spec) };
}

const definitions = MESSAGES.map(define);
export const definitionById = new Map(definitions.map((one) => [one.id, one]));
export const definitionByName = new Map(definitions.map((one) => [one.name, one]));

const text = new TextDecoder();
const utf8 = new TextEncoder();

/** `view` must hold `definition.size` bytes from its start. */
export function readField(view: DataView, field: Field): FieldValue {
  if (field.type === 'c8') {
    const bytes = new Uint8Array(view.buffer, view.byteOffset + field.offset, Math.max(1, field.length));
    const end = bytes.indexOf(0);
    return text.decode(end < 0 ? bytes : bytes.subarray(0, end));
  }
  if (!field.length) return readNumber(view, field.type, field.offset);
  const step = SIZE_OF[field.type];
  const values: (number | bigint)[] = [];
  for (let index = 0; index < field.length; index++) {
    values.push(readNumber(view, field.type, field.offset + index * step));
  }
  return values as number[] | bigint[];
}

function writeOne(view: DataView, type: FieldType, at: number, value: number | bigint): void {
  switch (type) {
    case 'c8':
    case 'u8':
      return view.setUint8(at, Number(value));
    case 'i8':
      return view.setInt8(at, Number(value));
    case 'u16':
      return view.setUint16(at, Number(value), true);
    case 'i16':
      return view.setInt16(at, Number(value), true);
    case 'u32':
      return view.setUint32(at, Number(value), true);
    case 'i32':
      return view.setInt32(at, Number(value), true);
    case 'u64':
      return view.setBigUint64(at, BigInt(value), true);
    case 'i64':
      return view.setBigInt64(at, BigInt(value), true);
    case 'f32':
      return view.setFloat32(at, Number(value), true);
    case 'f64':
      return view.setFloat64(at, Number(value), true);
  }
}

/** Truncates text that is longer than its field; pads shorter text and arrays with zeros. */
export function writeField(view: DataView, field: Field, value: FieldValue): void {
  if (typeof value === 'string') {
    const bytes = utf8.encode(value).subarray(0, Math.max(1, field.length));
    new Uint8Array(view.buffer, view.byteOffset + field.offset).set(bytes);
  } else if (Array.isArray(value)) {
    const step = SIZE_OF[field.type];
    for (let index = 0; index < Math.min(field.length, value.length); index++) {
      writeOne(view, field.type, field.offset + index * step, value[index]!);
    }
  } else {
    writeOne(view, field.type, field.offset, value);
  }
}
