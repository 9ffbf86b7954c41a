/**
 * Texts that the tower and its agents wrote in English, in the chosen language. The catalogue's keys are their English
 * texts (web/scripts/tower_texts.py): `{name}` stands for a value that stays as it is, `{name:number}` for a number, and
 * `{name:text}` for a value that is a text of the catalogue itself. What nobody knows stays in English: a text of an
 * older or newer tower, of an autopilot, or of a person.
 */

import { inLanguage } from './text';

export type TowerTexts = Readonly<Record<string, string>>;

interface Hole {
  readonly name: string;
  readonly kind: 'value' | 'number' | 'text';
}

/** `literals` has one more than `holes`: what stands before, between and behind them. */
interface Pattern {
  readonly translation: string;
  readonly literals: readonly string[];
  readonly holes: readonly Hole[];
  /** How much of the text is not a value: of two patterns that match, the one with more says what is meant. */
  readonly weight: number;
  readonly longest: string;
}

type Values = Readonly<Record<string, string>>;

/** A text within a text within a text: no sentence of the tower goes deeper. */
const MAX_DEPTH = 4;
const MAX_REMEMBERED = 1000;
/** A pattern with less than this of its own says nothing of a whole text: "{first} and {second}". */
const LEAST_WEIGHT = 6;
const HOLE = /\{(\w+)(?::(\w+))?\}/g;
const NUMBER = /^[-−+]?\d[\d.,]*( ?%)?$/;
/** Between the parts of a list that the tower joined. */
const LIST_MARKS = /(; |, and |, | and )/;
const SENTENCE_END = /(?<=[.!?]) (?=[A-Z])/;

let texts: TowerTexts | null = null;
let patterns: readonly Pattern[] = [];
const remembered = new Map<string, string | null>();

/** Null: English, which needs nothing of this. */
export function useTowerTexts(catalogue: TowerTexts | null): void {
  texts = catalogue;
  patterns = [];
  remembered.clear();
}

/** Wraps a translation of whole answers, so that readers of English copy nothing. */
export const forReaders =
  <T>(translate: (value: T) => T): ((value: T) => T) =>
  (value) =>
    texts === null ? value : translate(value);

/** `said` in the chosen language; as it is where the catalogue does not know it. */
export function towerText(said: string): string {
  if (texts === null || said === '') return said;
  return whole(said, 0) ?? said;
}

/** The same for each named text of an object. Others stay as they are. */
export function inTowerWords<T extends object, K extends keyof T>(value: T, ...names: readonly K[]): T {
  if (texts === null) return value;
  const changed = { ...value };
  for (const name of names) {
    const said: unknown = value[name];
    if (typeof said === 'string') changed[name] = towerText(said) as T[K];
  }
  return changed;
}

/**
 * The translation of a text, of the same text with another beginning or end, or of its sentences. First what is known
 * in all its parts.
 */
function whole(said: string, depth: number): string | null {
  if (depth > MAX_DEPTH) return null;
  const known = remembered.get(said);
  if (known !== undefined) return known;
  const found =
    plain(said, depth, true) ??
    otherEnds(said, depth, true) ??
    inSentences(said, depth, true) ??
    plain(said, depth, false) ??
    otherEnds(said, depth, false) ??
    inSentences(said, depth, false);
  if (remembered.size >= MAX_REMEMBERED) remembered.clear();
  remembered.set(said, found);
  return found;
}

function plain(said: string, depth: number, isStrict: boolean): string | null {
  const exact = texts?.[said];
  if (exact) return exact;
  for (const pattern of known()) {
    if (pattern.weight < LEAST_WEIGHT && (depth === 0 || !isStrict)) break; // the heaviest come first
    if (!said.includes(pattern.longest)) continue;
    const values = match(pattern, said, depth, isStrict);
    if (values) return pattern.translation.replace(HOLE, (hole, name: string) => values[name] ?? hole);
  }
  return null;
}

/** The console and the tower put a capital at the beginning of a text, and a full stop behind it. */
function otherEnds(said: string, depth: number, isStrict: boolean): string | null {
  const lower = said.charAt(0).toLowerCase() + said.slice(1);
  if (lower !== said) {
    const found = plain(lower, depth, isStrict);
    if (found) return found.charAt(0).toUpperCase() + found.slice(1);
  }
  if (!said.endsWith('.')) return null;
  const bare = said.slice(0, -1);
  const found = plain(bare, depth, isStrict) ?? (lower === said ? null : otherEnds(bare, depth, isStrict));
  return found && `${found}.`;
}

/** Strict: each sentence is known. */
function inSentences(said: string, depth: number, isStrict: boolean): string | null {
  const sentences = said.split(SENTENCE_END);
  if (sentences.length < 2) return null;
  const found = sentences.map((one) => whole(one, depth + 1));
  const isKnown = isStrict ? found.every((one) => one !== null) : found.some((one) => one !== null);
  return isKnown ? found.map((one, at) => one ?? sentences[at]).join(' ') : null;
}

/** A part of a text that is a text itself, or a list of such. Null: unknown. */
function part(said: string, depth: number): string | null {
  if (said === '') return '';
  const found = whole(said, depth) ?? otherEdges(said, depth);
  if (found !== null) return found;
  const pieces = said.split(LIST_MARKS);
  if (pieces.length < 2) return null;
  const words = pieces.map((one, at) => whole(one, depth) ?? (at % 2 ? one : null));
  return words.every((one) => one !== null) ? words.join('') : null;
}

/** Parts keep the spaces that the catalogue has around them, or not. */
function otherEdges(said: string, depth: number): string | null {
  const bare = said.trim();
  const found = bare === said || bare === '' ? null : whole(bare, depth);
  return found && said.replace(bare, () => found);
}

function known(): readonly Pattern[] {
  if (patterns.length === 0) {
    patterns = Object.entries(texts ?? {})
      .filter(([key, translation]) => key.includes('{') && translation !== '')
      .map(([key, translation]) => compiled(key, translation))
      .sort((a, b) => b.weight - a.weight);
  }
  return patterns;
}

function compiled(key: string, translation: string): Pattern {
  const holes = [...key.matchAll(HOLE)].map(([, name = '', kind]) => ({
    name,
    kind: kind === 'number' || kind === 'text' ? kind : 'value',
  })) satisfies Hole[];
  const literals = key.split(/\{\w+(?::\w+)?\}/);
  const longest = literals.reduce((best, one) => (one.length > best.length ? one : best), '');
  return { translation, literals, holes, weight: literals.join('').length, longest };
}

/** The values of a pattern in a text, by name; null if it does not match. Strict: each part of kind text is known. */
function match({ literals, holes, weight }: Pattern, said: string, depth: number, isStrict: boolean): Values | null {
  const first = literals[0] ?? '';
  if (!said.startsWith(first)) return null;
  const values: Record<string, string> = {};
  const fill = (at: number, from: number): boolean => {
    const hole = holes[at];
    if (hole === undefined) return from === said.length;
    const next = literals[at + 1] ?? '';
    const isLast = at === holes.length - 1;
    let end = isLast ? said.length - next.length : said.indexOf(next, from);
    while (end >= from) {
      const value = valueOf(hole, said.slice(from, end), depth, isStrict);
      const isFilled = weight >= LEAST_WEIGHT || end > from;
      if (isFilled && value !== null && said.startsWith(next, end) && fill(at + 1, end + next.length)) {
        values[hole.name] = value;
        return true;
      }
      if (isLast || end >= said.length) return false;
      end = said.indexOf(next, end + 1);
    }
    return false;
  };
  return fill(0, first.length) ? values : null;
}

function valueOf({ kind }: Hole, said: string, depth: number, isStrict: boolean): string | null {
  if (kind === 'number') return NUMBER.test(said) ? inLanguage(said) : null;
  if (kind === 'text') return part(said, depth + 1) ?? (isStrict ? null : said);
  return said === '' || (isStrict && SENTENCE_END.test(said)) ? null : said;
}
