/** Selects and groups the parameters of a page. */

import { t } from '../languages/text';
import { factOf, type Facts } from './facts';
import type { Parameter } from './kinds';

const SINGLE = t('Others');

/** The part before the first underscore, without an instance number: RC1_MIN is in RC, EK3_ENABLE in EK3. */
export function groupsOf(parameters: readonly Parameter[]): ReadonlyMap<string, string> {
  const numbersOf = new Map<string, Set<string>>();
  const counts = new Map<string, number>();
  const split = (name: string): { stem: string; number: string } | null => {
    const [, stem, number] = /^([A-Za-z]+)(\d*)(?:[A-Z]*)_/.exec(name) ?? [];
    return stem === undefined ? null : { stem, number: number ?? '' };
  };
  for (const { name } of parameters) {
    const parts = split(name);
    if (parts) numbersOf.set(parts.stem, (numbersOf.get(parts.stem) ?? new Set()).add(parts.number));
  }
  const groupOf = (name: string): string => {
    const parts = split(name);
    if (!parts) return SINGLE;
    return (numbersOf.get(parts.stem)?.size ?? 0) > 1 ? parts.stem : parts.stem + parts.number;
  };
  for (const { name } of parameters) counts.set(groupOf(name), (counts.get(groupOf(name)) ?? 0) + 1);
  return new Map(
    parameters.map(({ name }) => {
      const group = groupOf(name);
      return [name, (counts.get(group) ?? 0) > 1 ? group : SINGLE];
    }),
  );
}

export interface Group {
  readonly name: string;
  readonly count: number;
}

/** In alphabetical order, ungrouped parameters at the end. */
export function groupList(groups: ReadonlyMap<string, string>): Group[] {
  const counts = new Map<string, number>();
  for (const group of groups.values()) counts.set(group, (counts.get(group) ?? 0) + 1);
  const isLast = (name: string): number => (name === SINGLE ? 1 : 0);
  return [...counts]
    .map(([name, count]) => ({ name, count }))
    .sort((a, b) => isLast(a.name) - isLast(b.name) || (a.name < b.name ? -1 : 1));
}

/** The searchable text of a parameter, in lower case. */
export function searchText(name: string, facts: Facts): string {
  const fact = factOf(facts, name);
  const choices = fact ? [...fact.choices, ...fact.bits].map(({ words }) => words) : [];
  return [name, name.replaceAll('_', ' '), fact?.title ?? '', fact?.text ?? '', ...choices].join(' ').toLowerCase();
}

/** Whether the text contains each word of the search. */
export function isFound(text: string, search: string): boolean {
  return search
    .toLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word));
}

export type Line =
  | { readonly kind: 'group'; readonly key: string; readonly name: string; readonly count: number }
  | { readonly kind: 'parameter'; readonly key: string; readonly parameter: Parameter };

/** The rows of the table: each group has a heading. `parameters` are sorted by name. */
export function linesOf(parameters: readonly Parameter[], groups: ReadonlyMap<string, string>): Line[] {
  const byGroup = new Map<string, Parameter[]>();
  for (const one of parameters) {
    const group = groups.get(one.name) ?? SINGLE;
    const members = byGroup.get(group);
    if (members) members.push(one);
    else byGroup.set(group, [one]);
  }
  const lines: Line[] = [];
  for (const { name } of groupList(new Map(parameters.map((one) => [one.name, groups.get(one.name) ?? SINGLE])))) {
    const members = byGroup.get(name) ?? [];
    lines.push({ kind: 'group', key: `group ${name}`, name, count: members.length });
    for (const parameter of members) lines.push({ kind: 'parameter', key: parameter.name, parameter });
  }
  return lines;
}
