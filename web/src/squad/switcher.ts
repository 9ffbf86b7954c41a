/** The order of the drones in the switcher: one's own, then those in trouble, then by name. Pure. */

export interface SwitcherEntry {
  readonly id: number;
  readonly name: string;
  readonly isOwn: boolean;
  /** Of its trouble (link/trouble.ts), smaller is worse; null: none. */
  readonly rank: number | null;
}

/** More is found by the search. */
export const MAX_SWITCHER_ENTRIES = 40;

const collator = new Intl.Collator(undefined, { numeric: true, sensitivity: 'base' });

export function inSwitcherOrder<Entry extends SwitcherEntry>(entries: readonly Entry[]): Entry[] {
  return [...entries]
    .sort(
      (a, b) =>
        Number(b.isOwn) - Number(a.isOwn) ||
        (a.rank ?? Infinity) - (b.rank ?? Infinity) ||
        collator.compare(a.name, b.name) ||
        a.id - b.id,
    )
    .slice(0, MAX_SWITCHER_ENTRIES);
}
