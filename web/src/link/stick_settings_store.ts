/** Syncs stick settings between this console and the tower: reads them after the sign-in, saves each change. */

import type { Clock } from './clock';
import type { Rest } from './rest';
import { DEFAULT_SETTINGS, readDocument, toDocument, type StickSettings } from './stick_settings';
import { Store } from './store';

export const DOCUMENT = 'sticks';
const SAVE_AFTER_MS = 400;

export type StoragePhase = 'unread' | 'reading' | 'kept' | 'saving' | 'failed';

export interface Kept {
  readonly settings: StickSettings;
  readonly phase: StoragePhase;
  /** For `failed`: the reason; the settings are then not the pilot's own, or not saved. */
  readonly why: string;
  /** Whether they are the pilot's own. Until then the sticks are disabled: guessed settings are worse than none. */
  readonly isRead: boolean;
}

const UNREAD: Kept = { settings: DEFAULT_SETTINGS, phase: 'unread', why: '', isRead: false };

export class StickSettingsStore {
  readonly kept = new Store<Kept>(UNREAD);
  readonly #clock: Clock;
  readonly #rest: Pick<Rest, 'preferences' | 'keepPreference'>;
  #cancelSave: () => void = () => undefined;
  /** One save at a time: of two on their way, the older could arrive last. */
  #saved: Promise<void> = Promise.resolve();
  #changes = 0;
  /** Answers for a previous user, or to a repeated request, are ignored. */
  #asked = 0;

  constructor(clock: Clock, rest: Pick<Rest, 'preferences' | 'keepPreference'>) {
    this.#clock = clock;
    this.#rest = rest;
  }

  async read(): Promise<void> {
    const asked = ++this.#asked;
    this.kept.update((kept) => ({ ...kept, phase: 'reading', why: '' }));
    try {
      const settings = readDocument((await this.#rest.preferences())[DOCUMENT]);
      if (asked === this.#asked) this.kept.set({ settings, phase: 'kept', why: '', isRead: true });
    } catch (error) {
      if (asked !== this.#asked) return;
      const why = error instanceof Error ? error.message : String(error);
      this.kept.set({ settings: DEFAULT_SETTINGS, phase: 'failed', why, isRead: false });
    }
  }

  /** Discards unreadable settings, on the pilot's own decision. */
  startAnew(): void {
    this.change(() => DEFAULT_SETTINGS);
  }

  change(change: (settings: StickSettings) => StickSettings): void {
    this.#asked++;
    const changes = ++this.#changes;
    this.kept.update(({ settings }) => ({ settings: change(settings), phase: 'saving', why: '', isRead: true }));
    this.#cancelSave();
    this.#cancelSave = this.#clock.after(SAVE_AFTER_MS, () => {
      this.#saved = this.#saved.then(() => this.#save(changes));
    });
  }

  forget(): void {
    this.#asked++;
    this.#changes++;
    this.#cancelSave();
    this.kept.set(UNREAD);
  }

  async #save(changes: number): Promise<void> {
    if (changes !== this.#changes) return; // changed again meanwhile, which saves it; or of a previous user
    const asked = ++this.#asked;
    let [phase, why]: [StoragePhase, string] = ['kept', ''];
    try {
      await this.#rest.keepPreference(DOCUMENT, toDocument(this.kept.get().settings));
    } catch (error) {
      [phase, why] = ['failed', error instanceof Error ? error.message : String(error)];
    }
    if (asked === this.#asked) this.kept.update((kept) => ({ ...kept, phase, why }));
  }
}
