/** The languages of the console, and which one a browser gets. */

export type Language = 'en' | 'pt';
/** `system`: the first language of the browser that the console has. */
export type LanguageChoice = 'system' | Language;

/** Each in its own words: whoever looks for it may read no other. */
export const LANGUAGE_NAMES: Readonly<Record<Language, string>> = { en: 'English', pt: 'Português' };

/** A language is offered when its catalogue is complete; `npm run texts:check` says what is lacking. */
export const OFFERED: readonly Language[] = ['en', 'pt'];

export const isLanguageChoice = (value: unknown): value is LanguageChoice =>
  value === 'system' || OFFERED.some((one) => one === value);

/** `wanted`: the browser's languages, the preferred one first, as `pt-BR`. */
export function languageFor(
  choice: LanguageChoice,
  wanted: readonly string[],
  offered: readonly Language[] = OFFERED,
): Language {
  if (choice !== 'system') return choice;
  for (const tag of wanted) {
    const found = offered.find((one) => one === tag.toLowerCase().split('-')[0]);
    if (found) return found;
  }
  return 'en';
}
