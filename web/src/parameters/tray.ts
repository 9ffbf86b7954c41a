/** Pending changes of parameters: names and values, compared with the drone's current ones. */

import { isSame, type Table } from './kinds';

export type Tray = ReadonlyMap<string, number>;

export interface Change {
  readonly name: string;
  readonly kind: number;
  readonly before: number;
  readonly after: number;
}

export const EMPTY_TRAY: Tray = new Map();

/** A value that the drone already has is no change. */
export function put(tray: Tray, table: Table, name: string, value: number): Tray {
  const parameter = table.get(name);
  if (!parameter) return tray;
  const next = new Map(tray);
  if (isSame(parameter.value, value, parameter.kind)) next.delete(name);
  else next.set(name, value);
  return next;
}

export function takenOut(tray: Tray, name: string): Tray {
  const next = new Map(tray);
  next.delete(name);
  return next;
}

/** By name; omits values that the drone has meanwhile, whoever wrote them. */
export function changes(tray: Tray, table: Table): Change[] {
  const found: Change[] = [];
  for (const [name, after] of tray) {
    const parameter = table.get(name);
    if (!parameter || isSame(parameter.value, after, parameter.kind)) continue;
    found.push({ name, kind: parameter.kind, before: parameter.value, after });
  }
  return found.sort((a, b) => (a.name < b.name ? -1 : 1));
}
