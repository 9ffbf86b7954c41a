/**
 * What is known of parameters beside their values: what they do, units, usual ranges, choices, bits, defaults.
 *
 * Written by us, one parameter a line (facts/arducopter.ts, facts/px4.ts):
 *
 *     NAME | title | unit | least..most | default | reboot | what it does
 *       = 0 first choice, 1 second choice
 *       & 0 first bit, 1 second bit
 *
 * A field that is not known is left empty. `#` in a name stands for any number, in the text for that number. A choice
 * or a bit whose words have a comma in them writes it as `;`.
 */

export interface Choice {
  readonly value: number;
  readonly words: string;
}

export interface Fact {
  readonly title: string;
  readonly text: string;
  readonly unit: string;
  /** Of what is usual: an autopilot may take more. Null: not known. */
  readonly least: number | null;
  readonly most: number | null;
  readonly standard: number | null;
  readonly needsReboot: boolean;
  readonly choices: readonly Choice[];
  /** `value`: the number of the bit. */
  readonly bits: readonly Choice[];
}

/** Unit, least, most, default, whether it needs a restart: of far more parameters than there are words about. */
export type Numbers = readonly [string, number | null, number | null, number | null, boolean];

export interface Facts {
  readonly words: ReadonlyMap<string, Fact>;
  readonly numbers: ReadonlyMap<string, Numbers>;
}

export const NO_FACTS: Facts = { words: new Map(), numbers: new Map() };

const numberOf = (text: string): number | null => (text === '' ? null : Number(text));

function readChoices(text: string): Choice[] {
  return text.split(',').map((one) => {
    const [, value, words] = /^\s*(-?\d+(?:\.\d+)?)\s+(.+?)\s*$/.exec(one) ?? [];
    if (value === undefined || words === undefined) throw new RangeError(`no choice: ${one}`);
    return { value: Number(value), words: words.replaceAll(';', ',') };
  });
}

/** Throws a RangeError about a line that is not as described above. */
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
    const [name, title, unit, range, standard, reboot, text, ...more] = line.split('|').map((one) => one.trim());
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
      bits: [],
    });
  }
  return facts;
}

interface Found<T> {
  readonly it: T;
  /** What `#` stands for. */
  readonly digits: string;
}

/** Of this very name, or of the name with `#` for one of its numbers. */
function find<T>(table: ReadonlyMap<string, T>, name: string): Found<T> | null {
  const own = table.get(name);
  if (own !== undefined) return { it: own, digits: '' };
  // One number after the other: EK3_SRC1_YAW is EK3_SRC#_YAW, not EK#_SRC#_YAW.
  for (const { index, 0: digits } of name.matchAll(/\d+/g)) {
    const shared = table.get(`${name.slice(0, index)}#${name.slice(index + digits.length)}`);
    if (shared !== undefined) return { it: shared, digits };
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
  bits: [],
};

/** What is known of it; null: nothing at all. */
export function factOf(facts: Facts, name: string): Fact | null {
  const found = find(facts.words, name);
  const numbers = find(facts.numbers, name)?.it;
  if (!found && !numbers) return null;
  const words = found?.it ?? NOTHING;
  const filled = (text: string): string => text.replaceAll('#', found?.digits ?? '');
  const [unit = '', least = null, most = null, standard = null, needsReboot = words.needsReboot] = numbers ?? [];
  const hasRange = least !== null || most !== null;
  return {
    ...words,
    title: filled(words.title),
    text: filled(words.text),
    unit: unit || words.unit,
    least: hasRange ? least : words.least,
    most: hasRange ? most : words.most,
    standard: standard ?? words.standard,
    needsReboot,
  };
}

/** Why a value that the kind holds is still not a usual one; empty when it is, or nothing is known. */
export function unusualWords(fact: Fact | null, value: number): string {
  // Many defaults are an "off" outside of the range.
  if (!fact || value === fact.standard) return '';
  if (fact.choices.length > 0 && !fact.choices.some((one) => one.value === value))
    return 'This is none of the known choices.';
  const unit = fact.unit && ` ${fact.unit}`;
  if (fact.least !== null && value < fact.least) return `Usually not below ${fact.least}${unit}.`;
  if (fact.most !== null && value > fact.most) return `Usually not above ${fact.most}${unit}.`;
  return '';
}

/** `Usually 1 to 10 m`; empty where no range is known. */
export function rangeWords(fact: Fact | null): string {
  if (!fact || (fact.least === null && fact.most === null)) return '';
  const unit = fact.unit && ` ${fact.unit}`;
  if (fact.most === null) return `Usually from ${fact.least}${unit}`;
  return fact.least === null ? `Usually to ${fact.most}${unit}` : `Usually ${fact.least} to ${fact.most}${unit}`;
}

/** A value in words, where it has any: a choice, or the bits that are set. */
export function meaningOf(fact: Fact | null, value: number): string {
  const choice = fact?.choices.find((one) => one.value === value);
  if (choice) return choice.words;
  if (!fact || fact.bits.length === 0 || !Number.isInteger(value) || value < 0) return '';
  const set = fact.bits.filter((bit) => hasBit(value, bit.value)).map(({ words }) => words);
  return set.length > 0 ? set.join(', ') : 'none';
}

/** Beyond 31 bits the operators of whole numbers would fail. */
export const hasBit = (value: number, bit: number): boolean => Math.floor(value / 2 ** bit) % 2 === 1;

export const withBit = (value: number, bit: number, isSet: boolean): number =>
  hasBit(value, bit) === isSet ? value : value + (isSet ? 1 : -1) * 2 ** bit;
