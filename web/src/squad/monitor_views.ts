/** Views of the Monitor that the user saved by name: what the list shows, and how. Pure. */

import { t } from '../languages/text';
import { FILTERS, isSortKey, type Filter, type Order } from './squad_list';

export const LIST_VIEWS = ['cards', 'compact', 'table'] as const;
export type ListView = (typeof LIST_VIEWS)[number];

export interface ListChoice {
  readonly view: ListView;
  readonly search: string;
  readonly filter: Filter;
  readonly order: Order;
}

export interface SavedView extends ListChoice {
  readonly name: string;
}

export interface SavedViews {
  readonly views: readonly SavedView[];
  /** The name of the view with which the Monitor opens; null: none. */
  readonly first: string | null;
}

/** Twelve of the longest keep far below the tower's 8 KiB for a document. */
export const MAX_VIEWS = 12;
export const MAX_NAME_LENGTH = 40;
const MAX_SEARCH_LENGTH = 100;

export const USUAL_LIST: ListChoice = {
  view: 'cards',
  search: '',
  filter: 'all',
  order: { key: 'state', isDescending: false },
};

const oneOf = <T extends string>(all: readonly T[], value: unknown, usual: T): T =>
  all.find((one) => one === value) ?? usual;

function readView(raw: unknown): SavedView[] {
  const { name, view, search, filter, order } = (raw ?? {}) as Record<string, unknown>;
  const { key, isDescending } = (order ?? {}) as Record<string, unknown>;
  if (typeof name !== 'string' || name === '') return [];
  return [
    {
      name: name.slice(0, MAX_NAME_LENGTH),
      view: oneOf(LIST_VIEWS, view, USUAL_LIST.view),
      search: typeof search === 'string' ? search.slice(0, MAX_SEARCH_LENGTH) : '',
      filter: oneOf(FILTERS, filter, USUAL_LIST.filter),
      order: isSortKey(key) ? { key, isDescending: isDescending === true } : USUAL_LIST.order,
    },
  ];
}

/** Makes sense of anything; what is unknown is as usual. */
export function readViews(document: unknown): SavedViews {
  const { views, first } = (document ?? {}) as Record<string, unknown>;
  const read = Array.isArray(views) ? views.flatMap(readView).slice(0, MAX_VIEWS) : [];
  return { views: read, first: read.find(({ name }) => name === first)?.name ?? null };
}

/** With this choice by this name; it replaces one of the same name. */
export function saved({ views, first }: SavedViews, name: string, choice: ListChoice): SavedViews {
  const { view, search, filter, order } = choice;
  const one: SavedView = { name, view, search: search.slice(0, MAX_SEARCH_LENGTH), filter, order };
  const at = views.findIndex((known) => known.name === name);
  return { views: at < 0 ? [...views, one] : views.with(at, one), first };
}

export function removed({ views, first }: SavedViews, name: string): SavedViews {
  return { views: views.filter((one) => one.name !== name), first: first === name ? null : first };
}

export const isSameChoice = (a: ListChoice, b: ListChoice): boolean =>
  a.view === b.view &&
  a.search === b.search &&
  a.filter === b.filter &&
  a.order.key === b.order.key &&
  a.order.isDescending === b.order.isDescending;

/** Why a view cannot be saved by this name; empty: it can. */
export function whyNotSave({ views }: SavedViews, name: string): string {
  if (name.trim() === '') return t('Give it a name.');
  if (name.length > MAX_NAME_LENGTH)
    return t('A name has {maxNameLength} letters at most.', { maxNameLength: MAX_NAME_LENGTH });
  if (views.length >= MAX_VIEWS && !views.some((one) => one.name === name))
    return t('You have {maxViews} views. Remove one first.', { maxViews: MAX_VIEWS });
  return '';
}
