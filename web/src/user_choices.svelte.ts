/** Choices about the console that follow the user from browser to browser. */

import { KeptDocument } from './kept_document.svelte';
import { isLanguageChoice, type LanguageChoice } from './languages/languages';
import { isTheme, prefer, type ThemeChoice } from './preferences.svelte';

export interface UserChoices {
  /** Null: not chosen. */
  readonly theme: ThemeChoice | null;
  /** Null: not chosen. */
  readonly language: LanguageChoice | null;
  /** Whether the tour was seen or put off. */
  readonly hasToured: boolean;
}

function readChoices(document: unknown): UserChoices {
  const { theme, language, hasToured } = (document ?? {}) as Record<string, unknown>;
  return {
    theme: isTheme(theme) ? theme : null,
    language: isLanguageChoice(language) ? language : null,
    hasToured: hasToured === true,
  };
}

const kept = new KeptDocument('console', readChoices);
/** By whoever used this browser before: people who share a machine are shown it once. */
const wasTouredHere = kept.current.hasToured;

export const userChoices = {
  get hasToured(): boolean {
    return wasTouredHere || kept.current.hasToured;
  },
  /** After the sign-in. False if the tower does not answer. */
  async recall(): Promise<boolean> {
    const isKnown = await kept.recall();
    const { theme, language } = kept.current;
    if (isKnown && theme !== null) prefer({ theme });
    // From the next page on: a page that may be flying never reloads by itself.
    if (isKnown && language !== null) prefer({ language });
    return isKnown;
  },
};

export function chooseTheme(theme: ThemeChoice): void {
  prefer({ theme });
  kept.change({ theme });
}

/** Takes effect when the page is loaded again: after the answer, else the tower's old choice would come back. */
export async function chooseLanguage(language: LanguageChoice): Promise<void> {
  prefer({ language });
  kept.change({ language });
  await kept.save();
}

export const tourIsOver = (): void => kept.change({ hasToured: true });
