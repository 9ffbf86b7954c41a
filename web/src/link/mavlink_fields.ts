/** The generated message tables, prepared for reading and writing payloads with a DataView. */

import { MESSAGES, type MessageName } from './generated/mavlink.gen';

export type FieldType = 'c8' | 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'u64' | 'i64' | 'f32' | 'f64';
export type FieldValue = number | bigint | string | number[] | bigint[];

export interface Field {
  readonly name: string;
  readonly type: FieldType;
  /** 0 for a single value. */
  readonly length: number;
  readonly offset: number;
}

export interface MessageDefinition {
  readonly id: number;
  readonly name: MessageName;
  readonly crcExtra: number;
  readonly fields: readonly Field[];
  /** Length of the whole payload with its extension fields, before zeros are cut off. */
  readonly size: number;
}

const SIZE_OF: Record<FieldType, number> = {
  c8: 1,
  u8: 1,
  i8: 1,
  u16: 2,
  i16: 2,
  u32: 4,
  i32: 4,
  u64: 8,
  i64: 8,
  f32: 4,
  f64: 8,
};

const SPEC = /^(\w+):(\w+)(?:\[(\d+)\])?$/;

function define([id, name, crcExtra, spec]: readonly [number, string, number, string]): MessageDefinition {
  let size = 0;
  const fields = spec.split(' ').map((text): Field => {
    const parts = SPEC.exec(text);
    if (!parts) throw new Error(`bad field in the generated table: ${text}`);
    const type = parts[2] as FieldType;
    const length = Number(parts[3] ?? 0);
    const field = { name: parts[1]!, type, length, offset: size };
    size += SIZE_OF[type] * Math.max(1, length);
    return field;
  });
  return { id, name: name as MessageName, crcExtra, fields, size };
}

const definitions = MESSAGES.map(define);
export const definitionById = new Map(definitions.map((one) => [one.id, one]));
export const definitionByName = new Map(definitions.map((one) => [one.name, one]));

const text = new TextDecoder();
const utf8 = new TextEncoder();

function readOne(view: DataView, type: FieldType, at: number): number | bigint {
  switch (type) {
    case 'c8':
    case 'u8':
      return view.getUint8(at);
    case 'i8':
      return view.getInt8(at);
    case 'u16':
      return view.getUint16(at, true);
    case 'i16':
      return view.getInt16(at, true);
    case 'u32':
      return view.getUint32(at, true);
    case 'i32':
      return view.getInt32(at, true);
    case 'u64':
      return view.getBigUint64(at, true);
    case 'i64':
      return view.getBigInt64(at, true);
    case 'f32':
      return view.getFloat32(at, true);
    case 'f64':
      return view.getFloat64(at, true);
  }
}

/** `view` must hold `definition.size` bytes from its start. */
export function readField(view: DataView, field: Field): FieldValue {
  if (field.type === 'c8') {
    const bytes = new Uint8Array(view.buffer, view.byteOffset + field.offset, Math.max(1, field.length));
    const end = bytes.indexOf(0);
    return text.decode(end < 0 ? bytes : bytes.subarray(0, end));
  }
  if (!field.length) return readOne(view, field.type, field.offset);
  const step = SIZE_OF[field.type];
  const values: (number | bigint)[] = [];
  for (let index = 0; index < field.length; index++) {
    values.push(readOne(view, field.type, field.offset + index * step));
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
