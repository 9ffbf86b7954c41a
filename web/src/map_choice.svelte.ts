/** Which map the user wants to see, remembered for the user by the tower, and by this browser for the first moment. */

import { DEFAULT_CHOICE, readChoice, type MapChoice } from './map/map_layers';
import { tower } from './tower.svelte';

const KEY = 'tower.map';
const DOCUMENT = 'map';
const SAVE_AFTER_MS = 600;

function stored(): unknown {
  try {
    return JSON.parse(localStorage.getItem(KEY) ?? 'null');
  } catch {
    return null; // forbidden or corrupt: the defaults
  }
}

let choice = $state.raw<MapChoice>(readChoice(stored()));
/** A change of this user's own counts more than an answer that comes after it. */
let isChanged = false;
let pendingSave: ReturnType<typeof setTimeout> | undefined;

export const mapChoice = {
  get current(): MapChoice {
    return choice;
  },
};

/** Asks the tower what this user chose, here or in another browser. */
export async function recallMapChoice(): Promise<void> {
  isChanged = false;
  try {
    const document = (await tower.rest.preferences())[DOCUMENT];
    if (!isChanged) choice = document === undefined ? DEFAULT_CHOICE : readChoice(document);
  } catch {
    // What this browser remembers is good enough.
  }
}

export function chooseMap(changes: Partial<MapChoice>): void {
  isChanged = true;
  choice = { ...choice, ...changes };
  try {
    localStorage.setItem(KEY, JSON.stringify(choice));
  } catch {
    // It then lasts as long as the page.
  }
  clearTimeout(pendingSave);
  pendingSave = setTimeout(() => {
    void tower.rest.keepPreference(DOCUMENT, { ...choice }).catch(() => undefined); // this browser has it
  }, SAVE_AFTER_MS);
}
