import { expect, it } from 'vitest';

import { found, MAX_FOUND, type EntryKind, type SearchEntry } from '../../src/search/search_entries';

const entry = (kind: EntryKind, label: string, detail = ''): SearchEntry => ({
  id: `${kind} ${label}`,
  kind,
  label,
  detail,
  run: () => undefined,
});

const ALL = [
  entry('command', 'Hold Kestrel'),
  entry('page', 'Missions'),
  entry('page', 'Parameters of Kestrel'),
  entry('drone', 'Kestrel', 'LOITER, alice'),
  entry('drone', 'Merlin', 'Offline'),
  entry('command', 'Theme: dark'),
];
const labels = (text: string): string[] => found(ALL, text).map(({ label }) => label);

it.each([
  ['', ['Kestrel', 'Merlin', 'Missions', 'Parameters of Kestrel', 'Hold Kestrel', 'Theme: dark']],
  ['kes', ['Kestrel', 'Parameters of Kestrel', 'Hold Kestrel']],
  ['hold', ['Hold Kestrel']],
  ['kestrel hold', ['Hold Kestrel']],
  ['alice', ['Kestrel']],
  ['LOITER', ['Kestrel']],
  ['m', ['Merlin', 'Missions', 'Parameters of Kestrel', 'Theme: dark']],
  ['osprey', []],
])('"%s" finds %s', (text, expected) => {
  expect(labels(text)).toEqual(expected);
});

it('finds a bounded number', () => {
  const many = Array.from({ length: 300 }, (_, at) => entry('drone', `Drone ${at}`));
  expect(found(many, 'drone')).toHaveLength(MAX_FOUND);
});
