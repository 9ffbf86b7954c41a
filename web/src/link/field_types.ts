/** The types of fields: their sizes, how the generated tables spell them, and how one number is read. */

export type FieldType = 'c8' | 'u8' | 'i8' | 'u16' | 'i16' | 'u32' | 'i32' | 'u64' | 'i64' | 'f32' | 'f64';

export interface Field {
  readonly name: string;
  readonly type: FieldType;
  /** 0 for a single value. */
  readonly length: number;
  readonly offset: number;
  /** As MAVLink spells it: `degE7`, `cm/s`; empty: none, or the table has no units. */
  readonly unit: string;
}

export const SIZE_OF: Readonly<Record<FieldType, number>> = {
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

const SPEC = /^(\w+):(\w+)(?:\[(\d+)\])?(?:@(.+))?$/;

/** Reads `name:type[length]@unit` for each field, separated by spaces. Returns the size of the whole payload as well. */
export function readFields(spec: string): { fields: readonly Field[]; size: number } {
  let size = 0;
  const fields = (spec ? spec.split(' ') : []).map((text): Field => {
    const parts = SPEC.exec(text);
    if (!parts) throw new Error(`bad field in the generated table: ${text}`);
    const type = parts[2] as FieldType;
    const length = Number(parts[3] ?? 0);
    const field = { name: parts[1]!, type, length, offset: size, unit: parts[4] ?? '' };
    size += SIZE_OF[type] * Math.max(1, length);
    return field;
  });
  return { fields, size };
}

export function readNumber(view: DataView, type: FieldType, at: number): number | bigint {
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
