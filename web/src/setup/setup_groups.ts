/** Pages of the set-up that are parameters: which of them, in groups under a title. */

import type { Table } from '../parameters/kinds';

export type ParameterPage = 'modes' | 'failsafes' | 'fence' | 'power' | 'frame';

/** A title, and names of parameters; `#` stands for any number. A name that a drone lacks is not shown. */
export type Group = readonly [string, readonly string[]];
export type SetupGroups = Readonly<Record<ParameterPage, readonly Group[]>>;

export interface FoundGroup {
  readonly title: string;
  readonly names: readonly string[];
}

const MAX_NUMBER = 16;

/** The groups with what this drone has. */
export function foundGroups(groups: readonly Group[], table: Table): readonly FoundGroup[] {
  return groups
    .map(([title, names]) => ({ title, names: names.flatMap(numbered).filter((name) => table.has(name)) }))
    .filter(({ names }) => names.length > 0);
}

const numbered = (name: string): readonly string[] =>
  name.includes('#') ? [...Array(MAX_NUMBER).keys()].map((at) => name.replace('#', String(at + 1))) : [name];
