/**
 * A vehicle's own parameter facts: the type 1 file of MAVLink's component metadata, overlaid on ours. The file comes
 * from a drone: anything invalid in it is skipped.
 */

import { t } from '../languages/text';
import { factOf, withOpenness, type Choice, type Fact, type Facts, type Numbers } from './facts';

/** More than any autopilot has. */
const MAX_PARAMETERS = 20_000;
const MAX_TEXT = 1_000;
/** The file writes `{n}` for the number in numbered parameters. */
const NUMBER = '{n}';

type Json = Readonly<Record<string, unknown>>;

const isObject = (value: unknown): value is Json =>
  typeof value === 'object' && value !== null && !Array.isArray(value);
const objects = (value: unknown): Json[] => (Array.isArray(value) ? value.filter(isObject) : []);
const text = (value: unknown): string => (typeof value === 'string' ? value.slice(0, MAX_TEXT) : '');
const number = (value: unknown): number | null => (Number.isFinite(value) ? (value as number) : null);

function listOf(value: unknown, key: 'value' | 'index'): Choice[] {
  const found = new Map<number, Choice>();
  for (const one of objects(value)) {
    const at = number(one[key]);
    const words = text(one['description']);
    if (at !== null && words !== '' && !found.has(at)) found.set(at, { value: at, words });
  }
  return [...found.values()].toSorted((a, b) => a.value - b.value);
}

/** Throws only a RangeError, for a file that has no parameters. */
export function factsOfComponent(json: unknown): Facts {
  if (!isObject(json) || json['version'] !== 1 || !Array.isArray(json['parameters'])) {
    throw new RangeError(t('This is no metadata of parameters, version 1.'));
  }
  const words = new Map<string, Fact>();
  const numbers = new Map<string, Numbers>();
  const choices = new Map<string, readonly Choice[]>();
  const bits = new Map<string, readonly Choice[]>();
  for (const one of objects(json['parameters']).slice(0, MAX_PARAMETERS)) {
    const name = text(one['name']).replaceAll(NUMBER, '#');
    if (name === '' || numbers.has(name)) continue;
    const [least, most] = [number(one['min']), number(one['max'])];
    const isRange = least === null || most === null || least < most;
    const [unit, standard, needsReboot] = [text(one['units']), number(one['default']), one['rebootRequired'] === true];
    numbers.set(name, [unit, isRange ? least : null, isRange ? most : null, standard, needsReboot]);
    const values = listOf(one['values'], 'value');
    const mask = listOf(one['bitmask'], 'index');
    if (values.length > 0) choices.set(name, values);
    if (mask.length > 0) bits.set(name, mask);
    const title = text(one['shortDesc']);
    if (title === '') continue;
    const nothing = {
      unit: '',
      least: null,
      most: null,
      standard: null,
      needsReboot,
      choices: [],
      isOpen: false,
      bits: [],
    };
    words.set(name, { title, text: text(one['longDesc']), ...nothing });
  }
  return { words, numbers, choices, bits };
}

/** Ours with the vehicle's numbers and lists, which match its exact firmware, and our texts where available. */
export function withVehicle(ours: Facts, vehicle: Facts): Facts {
  return { ...ours, overlay: (known, name) => laidOver(name, known, factOf(vehicle, name)) };
}

/** The fact about one parameter, overlaid with the vehicle's. */
export const factWithVehicle = (ours: Facts, vehicle: Facts, name: string): Fact | null =>
  factOf(withVehicle(ours, vehicle), name);

function laidOver(name: string, known: Fact | null, reported: Fact | null): Fact | null {
  if (!known || !reported) return known ?? reported;
  const hasRange = reported.least !== null || reported.most !== null;
  const worded = (list: readonly Choice[], ofOurs: readonly Choice[]): readonly Choice[] => {
    const wordsOf = new Map(ofOurs.map(({ value, words }) => [value, words]));
    return list.length === 0 ? ofOurs : list.map((one) => ({ ...one, words: wordsOf.get(one.value) ?? one.words }));
  };
  return withOpenness(name, {
    isOpen: false,
    title: known.title || reported.title,
    text: known.text || reported.text,
    unit: reported.unit || known.unit,
    least: hasRange ? reported.least : known.least,
    most: hasRange ? reported.most : known.most,
    standard: reported.standard ?? known.standard,
    needsReboot: reported.needsReboot,
    choices: worded(reported.choices, known.choices),
    bits: worded(reported.bits, known.bits),
  });
}
