/**
 * Which values a user sees of a kind of drone: in which order, how large, how drawn, with which limits. Pure; saved
 * layouts have names, and a layout travels to another person as text.
 */

export const SIZES = ['small', 'wide', 'large'] as const;
export const LOOKS = ['number', 'gauge', 'sparkline'] as const;
export type Size = (typeof SIZES)[number];
export type Look = (typeof LOOKS)[number];

export interface ValueItem {
  /** Of the catalogue, or `MESSAGE.field`. */
  readonly id: string;
  readonly size: Size;
  readonly look: Look;
  /** Coloured below and above; null: no limit. Metric. */
  readonly low: number | null;
  readonly high: number | null;
}

export type Layout = readonly ValueItem[];

export interface SavedLayout {
  readonly name: string;
  readonly items: Layout;
}

export interface ValueChoices {
  /** By kind of drone; a kind without one has the usual values. */
  readonly kinds: Readonly<Record<string, Layout>>;
  readonly saved: readonly SavedLayout[];
}

export const MAX_ITEMS = 24;
/** The tower keeps 8 KiB of a document. */
export const MAX_CHARACTERS = 7_500;
export const MAX_SAVED = 3;
const MAX_KINDS = 3;
const MAX_NAME_LENGTH = 40;
const ID = /^[A-Za-z0-9_.-]{1,48}$/;

const USUAL_IDS = [
  ...['mode', 'armed', 'altitude', 'over-ground', 'climb', 'speed', 'heading', 'battery', 'battery-left'],
  ...[
    'throttle',
    'gps',
    'estimator',
    'wind',
    'landed',
    'distance-to-home',
    'distance-to-target',
    'flight-time',
    'link',
  ],
  ...['latitude', 'longitude'],
];

export const itemOf = (id: string): ValueItem => ({ id, size: 'small', look: 'number', low: null, high: null });
export const USUAL_LAYOUT: Layout = USUAL_IDS.map(itemOf);
/** What the flight bar and the attitude indicator show. */
const IN_BAR: ReadonlySet<string> = new Set([
  ...['mode', 'altitude', 'climb', 'speed', 'heading', 'battery', 'battery-left', 'distance-to-home', 'link'],
]);
const LAYOUT_BESIDE_BAR: Layout = USUAL_LAYOUT.filter(({ id }) => !IN_BAR.has(id));
export const NO_CHOICES: ValueChoices = { kinds: {}, saved: [] };

const oneOf = <T extends string>(all: readonly T[], value: unknown, usual: T): T =>
  all.find((one) => one === value) ?? usual;
const limit = (value: unknown): number | null => (typeof value === 'number' && Number.isFinite(value) ? value : null);

/** Makes sense of anything; what is no item is left out. Null: no layout at all. */
export function readLayout(raw: unknown): Layout | null {
  if (!Array.isArray(raw)) return null;
  const items = raw.flatMap((one: unknown): ValueItem[] => {
    const { id, size, look, low, high } = (one ?? {}) as Record<string, unknown>;
    if (typeof id !== 'string' || !ID.test(id)) return [];
    return [
      {
        id,
        size: oneOf(SIZES, size, 'small'),
        look: oneOf(LOOKS, look, 'number'),
        low: limit(low),
        high: limit(high),
      },
    ];
  });
  const known = new Set<string>();
  return items.filter(({ id }) => !known.has(id) && known.add(id)).slice(0, MAX_ITEMS);
}

export function readChoices(document: unknown): ValueChoices {
  const { kinds, saved } = (document ?? {}) as Record<string, unknown>;
  const read = Object.entries((kinds ?? {}) as Record<string, unknown>).flatMap(([kind, raw]) => {
    const layout = readLayout(raw);
    return layout ? [[kind, layout] as const] : [];
  });
  const named = Array.isArray(saved) ? saved : [];
  return {
    kinds: Object.fromEntries(read.slice(0, MAX_KINDS)),
    saved: named
      .flatMap((one: unknown): SavedLayout[] => {
        const { name, items } = (one ?? {}) as Record<string, unknown>;
        const layout = readLayout(items);
        return typeof name === 'string' && name && layout
          ? [{ name: name.slice(0, MAX_NAME_LENGTH), items: layout }]
          : [];
      })
      .slice(0, MAX_SAVED),
  };
}

/** `isBesideBar`: a user who chose nothing sees there what the bar and the instruments do not show. */
export const layoutOf = ({ kinds }: ValueChoices, kind: string, isBesideBar = false): Layout =>
  kinds[kind] ?? (isBesideBar ? LAYOUT_BESIDE_BAR : USUAL_LAYOUT);

/** Null: as usual. */
export function withLayout(choices: ValueChoices, kind: string, layout: Layout | null): ValueChoices {
  const others = Object.entries(choices.kinds).filter(([name]) => name !== kind);
  const kept = layout === null ? others : [[kind, layout] as const, ...others].slice(0, MAX_KINDS);
  return bounded({ ...choices, kinds: Object.fromEntries(kept) });
}

/** The item at `from` comes to stand at `to`. */
export function movedItem(layout: Layout, from: number, to: number): Layout {
  const item = layout[from];
  const at = Math.min(Math.max(to, 0), layout.length - 1);
  return item === undefined || at === from ? layout : layout.toSpliced(from, 1).toSpliced(at, 0, item);
}

export const addedItem = (layout: Layout, id: string): Layout =>
  !ID.test(id) || layout.length >= MAX_ITEMS || layout.some((one) => one.id === id) ? layout : [...layout, itemOf(id)];

/** Under a name; replaces one of the same name. */
export function savedAs(choices: ValueChoices, name: string, items: Layout): ValueChoices {
  const one = { name: name.trim().slice(0, MAX_NAME_LENGTH), items };
  if (!one.name) return choices;
  const others = choices.saved.filter((known) => known.name !== one.name);
  return bounded({ ...choices, saved: [...others, one].slice(-MAX_SAVED) });
}

/** What is too long for the tower loses its oldest saved layouts, then the kinds that were changed longest ago. */
function bounded(choices: ValueChoices): ValueChoices {
  if (JSON.stringify(choices).length <= MAX_CHARACTERS) return choices;
  if (choices.saved.length > 0) return bounded({ ...choices, saved: choices.saved.slice(1) });
  return bounded({ ...choices, kinds: Object.fromEntries(Object.entries(choices.kinds).slice(0, -1)) });
}

export const layoutText = (layout: Layout): string => JSON.stringify(layout);

/** A layout that somebody sent; null: it is none. */
export function layoutOfText(text: string): Layout | null {
  try {
    const layout = readLayout(JSON.parse(text));
    return layout && layout.length > 0 ? layout : null;
  } catch {
    return null;
  }
}

export type LimitTone = 'normal' | 'danger';

/** Beyond its limits a value is coloured. */
export const limitTone = ({ low, high }: ValueItem, number: number | null): LimitTone =>
  number !== null && ((low !== null && number < low) || (high !== null && number > high)) ? 'danger' : 'normal';
