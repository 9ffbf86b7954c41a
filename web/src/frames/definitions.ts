/** Every message of the dialect with the units of its fields, for charts and the inspector. A large table: load it late. */

import { ALL_MESSAGES } from '../link/generated/all_messages.gen';
import type { FieldType } from '../link/mavlink_fields';

export interface NamedField {
  readonly name: string;
  readonly type: FieldType;
  /** 0 for a single value. */
  readonly length: number;
  readonly offset: number;
  /** As MAVLink spells it: `degE7`, `cm/s`; empty: none. */
  readonly unit: string;
}

export interface Definition {
  readonly id: number;
  readonly name: string;
  readonly crcExtra: number;
  readonly fields: readonly NamedField[];
  /** Length of the whole payload. */
  readonly size: number;
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

function define([id, name, crcExtra, spec]: (typeof ALL_MESSAGES)[number]): Definition {
  let size = 0;
  const fields =
    spec === ''
      ? []
      : spec.split(' ').map((text): NamedField => {
          const parts = SPEC.exec(text);
          if (!parts) throw new Error(`bad field in the generated table: ${text}`);
          const type = parts[2] as FieldType;
          const length = Number(parts[3] ?? 0);
          const field = { name: parts[1]!, type, length, offset: size, unit: parts[4] ?? '' };
          size += SIZE_OF[type] * Math.max(1, length);
          return field;
        });
  return { id, name, crcExtra, fields, size };
}

const byId = new Map(ALL_MESSAGES.map((row) => [row[0], row]));
const made = new Map<number, Definition>();

/** Null for a message that the dialect does not have. */
export function definitionOf(msgid: number): Definition | null {
  const known = made.get(msgid);
  if (known) return known;
  const row = byId.get(msgid);
  if (!row) return null;
  const definition = define(row);
  made.set(msgid, definition);
  return definition;
}

export const messageName = (msgid: number): string => byId.get(msgid)?.[1] ?? `message ${msgid}`;
