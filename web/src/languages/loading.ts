/**
 * Loads the catalogue of the chosen language, before anything that has texts. English has none to load. May import
 * nothing with texts, as main.ts.
 */

import { isLanguageChoice, languageFor, type Language } from './languages';
import { useCatalogue, type Catalogue } from './text';
import { useTowerTexts, type TowerTexts } from './tower_text';

/** Where preferences.svelte.ts keeps the choice: it cannot be asked, because it has texts. */
export const PREFERENCES_KEY = 'tower.preferences';

const CATALOGUES: Readonly<Record<Exclude<Language, 'en'>, () => Promise<{ default: Catalogue; tower: TowerTexts }>>> =
  {
    pt: () => import('./pt/portuguese'),
  };

function chosenHere(): Language {
  try {
    const stored = JSON.parse(localStorage.getItem(PREFERENCES_KEY) ?? '{}') as { language?: unknown } | null;
    const choice = stored?.language;
    return languageFor(isLanguageChoice(choice) ? choice : 'system', navigator.languages);
  } catch {
    return languageFor('system', navigator.languages); // storage is forbidden or corrupt
  }
}

/** In English if the catalogue cannot be loaded: a pilot needs the console in any language. */
export async function loadLanguage(): Promise<void> {
  const language = chosenHere();
  if (language === 'en') return;
  try {
    const { default: texts, tower } = await CATALOGUES[language]();
    useCatalogue(language, texts);
    useTowerTexts(tower);
    document.documentElement.lang = language;
  } catch {
    useCatalogue('en', null);
  }
}
