/** Autopilot parameters as people read and type them: their kinds, the text of a value, and the value of a text. */

import { t } from '../languages/text';

export interface Parameter {
  readonly name: string;
  readonly value: number;
  /** MAV_PARAM_TYPE. */
  readonly kind: number;
}

/** By name. */
export type Table = ReadonlyMap<string, Parameter>;

export const tableOf = (parameters: Iterable<Parameter>): Table =>
  new Map([...parameters].map((one) => [one.name, one]));

const FLOAT = 9;
const DOUBLE = 10;
/** The range of each integer kind; for 64 bits, the range that a number on the wire represents exactly. */
const WHOLE: Readonly<Record<number, readonly [number, number]>> = {
  1: [0, 0xff],
  2: [-0x80, 0x7f],
  3: [0, 0xffff],
  4: [-0x8000, 0x7fff],
  5: [0, 0xffff_ffff],
  6: [-0x8000_0000, 0x7fff_ffff],
  7: [0, Number.MAX_SAFE_INTEGER],
  8: [Number.MIN_SAFE_INTEGER, Number.MAX_SAFE_INTEGER],
};

export const isWhole = (kind: number): boolean => kind in WHOLE;

export function kindWords(kind: number): string {
  const bounds = WHOLE[kind];
  if (!bounds) return kind === FLOAT || kind === DOUBLE ? t('number') : t('kind {kind}', { kind });
  return t('whole number, {bounds} to {bounds2}', { bounds: bounds[0], bounds2: bounds[1] });
}

/** The number as the autopilot stores it. */
export const kept = (value: number, kind: number): number => (kind === FLOAT ? Math.fround(value) : value) + 0;

export const isSame = (one: number, other: number, kind: number): boolean => kept(one, kind) === kept(other, kind);

/** The shortest text for this value: 0.135, not 0.13500000536. */
export function valueText(value: number, kind: number): string {
  if (kind !== FLOAT) return String(value);
  for (let digits = 6; digits <= 9; digits++) {
    const text = String(Number(value.toPrecision(digits)));
    if (Math.fround(Number(text)) === Math.fround(value)) return text;
  }
  return String(value);
}

export interface Typed {
  /** Null: no valid value; `fault` says why. */
  readonly value: number | null;
  readonly fault: string;
}

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
const HEXADECIMAL = /^0x[0-9a-f]+$/i;

/** Parses the text typed for a parameter of this kind. */
export function readValue(text: string, kind: number): Typed {
  const typed = text.trim().replace('−', '-');
  const none = (fault: string): Typed => ({ value: null, fault });
  if (typed === '') return none(t('A number is missing.'));
  if (/^[+-]?\d+,\d+$/.test(typed)) return none(t('Write the decimals after a point.'));
  if (!NUMBER.test(typed) && !HEXADECIMAL.test(typed)) return none(t('This is not a number.'));
  const value = Number(typed);
  const bounds = WHOLE[kind];
  if (!bounds) {
    const isTooLarge = !Number.isFinite(kept(value, kind));
    return isTooLarge ? none(t('This number is too large.')) : { value: kept(value, kind), fault: '' };
  }
  if (!Number.isInteger(value)) return none(t('Whole numbers only.'));
  const [least, most] = bounds;
  if (value < least || value > most) return none(t('Enter {least} to {most}.', { least, most }));
  return { value: value + 0, fault: '' };
}
