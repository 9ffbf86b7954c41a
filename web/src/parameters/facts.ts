/**
 * Facts about parameters beside their values: what they do, units, usual ranges, choices, bits, defaults.
 *
 * Our own texts, one parameter per line (facts/arducopter.ts, facts/px4.ts):
 *
 *     NAME | title | unit | least..most | default | reboot | what it does
 *       = 0 first choice, 1 second choice
 *       & 0 first bit, 1 second bit
 *
 * or, if the table of metadata has the rest, `NAME | title | what it does`. An unknown field is empty. `#` in a name
 * matches any number, and in the text it is that number; `*` at the end of a name matches any suffix, and in the title
 * it is that suffix, spelled out. A comma in the text of a choice or a bit is written as `;`.
 *
 * facts/*_metadata.json have units, ranges, defaults, choices and bits of nearly all parameters
 * (scripts/build_parameter_facts.py).
 */

import { t } from '../languages/text';
import { spelledOut } from './abbreviations';

export interface Choice {
  readonly value: number;
  readonly words: string;
}

export interface Fact {
  readonly title: string;
  readonly text: string;
  readonly unit: string;
  /** Of the usual range: an autopilot may accept more. Null: unknown. */
  readonly least: number | null;
  readonly most: number | null;
  readonly standard: number | null;
  readonly needsReboot: boolean;
  readonly choices: readonly Choice[];
  /** Values other than the choices are valid: the choices cover part of a range, or name a few values. */
  readonly isOpen: boolean;
  /** `value`: the number of the bit. */
  readonly bits: readonly Choice[];
}

/**
 * Titles in another language, by part: "Compass #: gate" is "Compass #" and "gate". The words of abbreviations.ts and
 * the titles of the set-up's groups are among them. What has no translation stays English.
 */
export type Labels = Readonly<Record<string, string>>;

export const inLabels = (title: string, labels: Labels): string =>
  title
    .split(': ')
    .map((part) => labels[part] ?? part)
    .join(': ');

/** Unit, least, most, default, whether it needs a restart: for far more parameters than have a text. */
export type Numbers = readonly [string, number | null, number | null, number | null, boolean];

type Lists = ReadonlyMap<string, readonly Choice[]>;

export interface Facts {
  readonly words: ReadonlyMap<string, Fact>;
  readonly numbers: ReadonlyMap<string, Numbers>;
  readonly choices: Lists;
  readonly bits: Lists;
  /** Of the titles, which are in this language already, and of what replaces `*` in them. */
  readonly labels?: Labels;
  /** Better knowledge from another source, laid over these facts. */
  readonly overlay?: (known: Fact | null, name: string) => Fact | null;
}

export const NO_FACTS: Facts = { words: new Map(), numbers: new Map(), choices: new Map(), bits: new Map() };

/** A table made by scripts/build_parameter_facts.py; `choices` and `bits` refer to a line of `lists`. */
export interface Metadata {
  readonly numbers: Readonly<Record<string, Numbers>>;
  readonly choices: Readonly<Record<string, number>>;
  readonly bits: Readonly<Record<string, number>>;
  readonly lists: readonly string[];
}

const numberOf = (text: string): number | null => (text === '' ? null : Number(text));

function readChoices(text: string): Choice[] {
  return text.split(',').map((one) => {
    const [, value, words] = /^\s*(-?\d+(?:\.\d+)?)\s+(.+?)\s*$/.exec(one) ?? [];
    if (value === undefined || words === undefined) throw new RangeError(`no choice: ${one}`);
    return { value: Number(value), words: words.replaceAll(';', ',') };
  });
}

/** Throws a RangeError for a line that does not match the format above. */
export function readFacts(source: string): ReadonlyMap<string, Fact> {
  const facts = new Map<string, Fact>();
  let last = '';
  for (const line of source.split('\n')) {
    if (line.trim() === '' || line.startsWith('//')) continue;
    const known = facts.get(last);
    const list = /^\s+([=&])\s+(.+)$/.exec(line);
    if (list && known) {
      const choices = readChoices(list[2]!);
      facts.set(last, list[1] === '=' ? { ...known, choices } : { ...known, bits: choices });
      continue;
    }
    const fields = line.split('|').map((one) => one.trim());
    const isShort = fields.length === 3;
    const [name, title, unit, range, standard, reboot, text, ...more] = isShort
      ? [fields[0], fields[1], '', '', '', '', fields[2]]
      : fields;
    if (!name || !title || text === undefined || more.length > 0 || facts.has(name)) {
      throw new RangeError(`no line of facts, or the second one: ${line}`);
    }
    const [least = '', most = ''] = (range ?? '').split('..');
    last = name;
    facts.set(name, {
      title,
      text,
      unit: unit ?? '',
      least: numberOf(least),
      most: numberOf(most),
      standard: numberOf(standard ?? ''),
      needsReboot: reboot === 'reboot',
      choices: [],
      isOpen: false,
      bits: [],
    });
  }
  return facts;
}

/** `words`: the lines of readFacts. Throws a RangeError for a line that does not match the format. */
export function factsOf(words: string, metadata: Metadata, labels: Labels = {}): Facts {
  const lists = metadata.lists.map(readChoices);
  const listed = (names: Readonly<Record<string, number>>): Lists =>
    new Map(Object.entries(names).map(([name, at]) => [name, lists[at]!]));
  const titled = [...readFacts(words)].map(([name, fact]): [string, Fact] => [
    name,
    { ...fact, title: inLabels(fact.title, labels) },
  ]);
  return {
    words: new Map(titled),
    labels,
    numbers: new Map(Object.entries(metadata.numbers)),
    choices: listed(metadata.choices),
    bits: listed(metadata.bits),
  };
}

interface Found<T> {
  readonly it: T;
  /** The digits that `#` matched. */
  readonly digits: string;
  /** The text that `*` matched. */
  readonly rest: string;
}

interface Shape {
  readonly name: string;
  readonly digits: string;
}

/**
 * The name with `#` for each of its numbers in turn, then for all: EK3_SRC1_YAW gives EK3_SRC#_YAW before EK#_SRC#_YAW.
 */
function shapesOf(name: string): Shape[] {
  const numbers = [...name.matchAll(/\d+/g)];
  const shapes = numbers.map(({ index, 0: digits }) => ({
    name: `${name.slice(0, index)}#${name.slice(index + digits.length)}`,
    digits,
  }));
  return numbers.length < 2 ? shapes : [...shapes, { name: name.replace(/\d+/g, '#'), digits: numbers[0]![0] }];
}

/** By the exact name, or by the name with `#` for its numbers. */
function find<T>(table: ReadonlyMap<string, T>, name: string): Found<T> | null {
  for (const shape of [{ name, digits: '' }, ...shapesOf(name)]) {
    const it = table.get(shape.name);
    if (it !== undefined) return { it, digits: shape.digits, rest: '' };
  }
  return null;
}

/** By the family whose prefix matches, the longest first. */
function findFamily<T>(table: ReadonlyMap<string, T>, name: string): Found<T> | null {
  for (let end = name.lastIndexOf('_'); end > 0; end = name.lastIndexOf('_', end - 1)) {
    const found = find(table, `${name.slice(0, end)}_*`);
    if (found) return { ...found, rest: name.slice(end + 1) };
  }
  return null;
}

/** A second instance uses the text of the first, which often has no number: BATT2_CAPACITY uses BATT_CAPACITY. */
function findFirst(words: ReadonlyMap<string, Fact>, name: string): Found<Fact> | null {
  for (const { index, 0: digits } of name.matchAll(/\d+/g)) {
    const found = words.get(`${name.slice(0, index)}${name.slice(index + digits.length)}`);
    if (found) return { it: { ...found, title: `${found.title} (${digits})` }, digits, rest: '' };
  }
  return null;
}

const NOTHING: Fact = {
  title: '',
  text: '',
  unit: '',
  least: null,
  most: null,
  standard: null,
  needsReboot: false,
  choices: [],
  isOpen: false,
  bits: [],
};

/** Our texts for values where available, then the published values without one. */
function merged(ours: readonly Choice[], published: readonly Choice[] | undefined): readonly Choice[] {
  if (!published || ours.length === 0) return published ?? ours;
  const known = new Set(ours.map(({ value }) => value));
  return [...ours, ...published.filter(({ value }) => !known.has(value))].toSorted((a, b) => a.value - b.value);
}

const PIN = /_PIN\d*$/;

/** Published choices are complete, unless they omit a part of the range, or have a unit; pins differ by board. */
export function withOpenness(name: string, fact: Fact): Fact {
  const { choices, least, most, unit } = fact;
  if (choices.length === 0) return fact;
  const values = new Set(choices.map(({ value }) => value));
  const isWhole = least !== null && most !== null && most - least < choices.length;
  const isRange = least !== null || most !== null;
  const leavesOut =
    isRange &&
    !(isWhole && Array.from({ length: most - least + 1 }, (_, at) => least + at).every((one) => values.has(one)));
  return { ...fact, isOpen: PIN.test(name) || unit !== '' || choices.length < 2 || leavesOut };
}

/** The fact about a parameter; null: none. */
export function factOf(facts: Facts, name: string): Fact | null {
  const known = ownFactOf(facts, name);
  return facts.overlay ? facts.overlay(known, name) : known;
}

function ownFactOf(facts: Facts, name: string): Fact | null {
  const found = find(facts.words, name) ?? findFirst(facts.words, name) ?? findFamily(facts.words, name);
  const numbers = find(facts.numbers, name)?.it;
  const choices = find(facts.choices, name)?.it;
  const bits = find(facts.bits, name)?.it;
  if (!found && !numbers && !choices && !bits) return null;
  const words = found?.it ?? NOTHING;
  const filled = (text: string, rest: string): string =>
    text.replaceAll('#', found?.digits ?? '').replaceAll('*', () => rest);
  const rest = found?.rest ?? '';
  const [unit = '', least = null, most = null, standard = null, needsReboot = words.needsReboot] = numbers ?? [];
  const hasRange = least !== null || most !== null;
  return withOpenness(name, {
    ...words,
    title: filled(words.title, spelledOut(rest, facts.labels)),
    text: filled(words.text, rest),
    unit: unit || words.unit,
    least: hasRange ? least : words.least,
    most: hasRange ? most : words.most,
    standard: standard ?? words.standard,
    needsReboot,
    choices: merged(words.choices, choices),
    bits: merged(words.bits, bits),
  });
}

/** Why a valid value is unusual; empty if it is usual, or nothing is known. */
export function unusualWords(fact: Fact | null, value: number): string {
  // Many defaults mean "off" and lie outside the range.
  if (!fact || value === fact.standard) return '';
  if (fact.choices.some((one) => one.value === value)) return '';
  if (fact.choices.length > 0 && !fact.isOpen) return t('This is none of the known choices.');
  const unit = fact.unit && ` ${fact.unit}`;
  if (fact.least !== null && value < fact.least)
    return t('Usually not below {least}{unit}.', { least: fact.least, unit });
  if (fact.most !== null && value > fact.most) return t('Usually not above {most}{unit}.', { most: fact.most, unit });
  return '';
}

/** `Usually 1 to 10 m`; empty if no range is known. */
export function rangeWords(fact: Fact | null): string {
  if (!fact || (fact.least === null && fact.most === null)) return '';
  const unit = fact.unit && ` ${fact.unit}`;
  if (fact.most === null) return t('Usually from {least}{unit}', { least: fact.least, unit });
  return fact.least === null
    ? t('Usually to {most}{unit}', { most: fact.most, unit })
    : t('Usually {least} to {most}{unit}', { least: fact.least, most: fact.most, unit });
}

/** A value in words, if available: a choice, or the bits that are set. */
export function meaningOf(fact: Fact | null, value: number): string {
  const choice = fact?.choices.find((one) => one.value === value);
  if (choice) return choice.words;
  if (!fact || fact.bits.length === 0 || !Number.isInteger(value) || value < 0) return '';
  const set = fact.bits.filter((bit) => hasBit(value, bit.value)).map(({ words }) => words);
  return set.length > 0 ? set.join(', ') : 'none';
}

/** Bitwise operators fail beyond 31 bits. */
export const hasBit = (value: number, bit: number): boolean => Math.floor(value / 2 ** bit) % 2 === 1;

export const withBit = (value: number, bit: number, isSet: boolean): number =>
  hasBit(value, bit) === isSet ? value : value + (isSet ? 1 : -1) * 2 ** bit;
