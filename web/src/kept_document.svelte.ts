/** A document of the user's choices: the tower keeps it for the user, this browser for the first moment. */

import { tower } from './tower.svelte';

const SAVE_AFTER_MS = 600;

export class KeptDocument<T extends { readonly [K in keyof T]: unknown }> {
  readonly #name: string;
  readonly #read: (document: unknown) => T;
  #now: T;
  /** A change of this user's own counts more than an answer that comes after it. */
  #isChanged = false;
  #pendingSave: ReturnType<typeof setTimeout> | undefined;

  /** `read` makes sense of anything, and has the defaults for undefined and null. */
  constructor(name: string, read: (document: unknown) => T) {
    this.#name = name;
    this.#read = read;
    this.#now = $state.raw(read(this.#stored()));
  }

  get current(): T {
    return this.#now;
  }

  /** Asks the tower what this user chose, here or in another browser. False if it does not answer. */
  async recall(): Promise<boolean> {
    this.#isChanged = false;
    try {
      const document = (await tower.rest.preferences())[this.#name];
      if (!this.#isChanged) this.#now = this.#read(document);
      return true;
    } catch {
      return false; // what this browser remembers is good enough
    }
  }

  change(changes: Partial<T>): void {
    this.#isChanged = true;
    this.#now = { ...this.#now, ...changes };
    try {
      localStorage.setItem(this.#key, JSON.stringify(this.#now));
    } catch {
      // It then lasts as long as the page.
    }
    clearTimeout(this.#pendingSave);
    this.#pendingSave = setTimeout(() => void this.save(), SAVE_AFTER_MS);
  }

  /** Sends changes that wait, for a page that is about to go. */
  async save(): Promise<void> {
    if (this.#pendingSave === undefined) return;
    clearTimeout(this.#pendingSave);
    this.#pendingSave = undefined;
    try {
      await tower.rest.keepPreference(this.#name, { ...this.#now });
    } catch {
      // This browser has it.
    }
  }

  get #key(): string {
    return `tower.${this.#name}`;
  }

  #stored(): unknown {
    try {
      return JSON.parse(localStorage.getItem(this.#key) ?? 'null');
    } catch {
      return null; // forbidden or corrupt: the defaults
    }
  }
}
