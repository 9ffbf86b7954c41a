/** Choices about the console that follow the user from browser to browser. */

import { KeptDocument } from './kept_document.svelte';
import { isTheme, prefer, type ThemeChoice } from './preferences.svelte';

export interface UserChoices {
  /** Null: not chosen. */
  readonly theme: ThemeChoice | null;
  /** Whether the tour was seen or put off. */
  readonly hasToured: boolean;
}

function readChoices(document: unknown): UserChoices {
  const { theme, hasToured } = (document ?? {}) as Record<string, unknown>;
  return { theme: isTheme(theme) ? theme : null, hasToured: hasToured === true };
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
    const { theme } = kept.current;
    if (isKnown && theme !== null) prefer({ theme });
    return isKnown;
  },
};

export function chooseTheme(theme: ThemeChoice): void {
  prefer({ theme });
  kept.change({ theme });
}

export const tourIsOver = (): void => kept.change({ hasToured: true });
