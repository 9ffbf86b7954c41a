/** Every message of the dialect with the units of its fields, for charts and the inspector. A large table: load it late. */

import { readFields, type Field } from '../link/field_types';
import { ALL_MESSAGES } from '../link/generated/all_messages.gen';

export interface Definition {
  readonly id: number;
  readonly name: string;
  readonly crcExtra: number;
  readonly fields: readonly Field[];
  /** Length of the whole payload. */
  readonly size: number;
}

function define([id, name, crcExtra, spec]: (typeof ALL_MESSAGES)[number]): Definition {
  return { id, name, crcExtra, ...readFields(spec) };
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
