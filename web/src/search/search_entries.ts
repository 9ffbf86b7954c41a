/** What the search finds: drones, pages and commands, and in which order. Pure. */

export type EntryKind = 'drone' | 'page' | 'command' | 'place';

export interface SearchEntry {
  readonly id: string;
  readonly kind: EntryKind;
  readonly label: string;
  /** Beside the label; searched too. */
  readonly detail: string;
  readonly run: () => unknown;
}

export const MAX_FOUND = 40;

const RANK: Record<EntryKind, number> = { place: 0, drone: 0, page: 1, command: 2 };

/** 0: the label begins with it; 1: a word of the label does; 2: elsewhere. Null: not found. */
function distance({ label, detail }: SearchEntry, words: readonly string[]): number | null {
  const [name, all] = [label.toLowerCase(), `${label} ${detail}`.toLowerCase()];
  if (!words.every((word) => all.includes(word))) return null;
  const text = words.join(' ');
  if (name.startsWith(text)) return 0;
  return name.split(/\s+/).some((word) => word.startsWith(words[0] ?? '')) ? 1 : 2;
}

/** Every word must occur. The best first; among equals drones, then pages, then commands, each in the given order. */
export function found(entries: readonly SearchEntry[], text: string): SearchEntry[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  return entries
    .flatMap((entry, at) => {
      const far = distance(entry, words);
      return far === null ? [] : [{ entry, at, far }];
    })
    .sort((a, b) => a.far - b.far || RANK[a.entry.kind] - RANK[b.entry.kind] || a.at - b.at)
    .slice(0, MAX_FOUND)
    .map(({ entry }) => entry);
}
