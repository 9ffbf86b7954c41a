/** What can be wrong with translations. */

import { readSource } from './source_tree.mjs';

const namesIn = (text) => new Set([...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name));
const formsOf = (translation) => (typeof translation === 'string' ? { other: translation } : translation);

/** Empty is not translated yet. */
export const isTranslated = (translation) => {
  if (translation === undefined) return false;
  const forms = Object.values(formsOf(translation));
  return forms.length > 0 && forms.every((text) => text !== '');
};

/** The languages of the constant `OFFERED`. */
export function offeredLanguages() {
  const [, list] = /OFFERED: readonly Language\[\] = \[([^\]]*)\]/.exec(readSource('languages/languages.ts')) ?? [];
  if (list === undefined) throw new Error('languages.ts has no list OFFERED any more');
  return new Set([...list.matchAll(/'(\w+)'/g)].map(([, language]) => language));
}

/**
 * The faults of one language, in words: texts that nobody uses, lacking and strange placeholders, lacking plural forms.
 * `messages`: of messages.mjs. `translations`: Map from key to a text, or to an object of plural forms.
 */
export function faultsOf(language, messages, translations) {
  const faults = [];
  const categories = new Intl.PluralRules(language).resolvedOptions().pluralCategories;
  for (const [key, translation] of translations) {
    const say = (words) => faults.push(`${language}: ${words}: "${key}"`);
    const message = messages.get(key);
    if (!message) say('nobody uses this text');
    else if (isTranslated(translation)) {
      const forms = formsOf(translation);
      if (message.isPlural && typeof translation === 'string') say('needs plural forms, as {"one": …, "other": …}');
      if (!message.isPlural && typeof translation !== 'string') say('does not count: needs one text');
      for (const category of Object.keys(forms))
        if (!categories.includes(category)) say(`has no plural form "${category}" in this language`);
      if (message.isPlural && !['one', 'other'].every((category) => category in forms)) say('lacks "one" or "other"');
      const wanted = new Set(message.names);
      for (const text of Object.values(forms)) {
        const given = namesIn(text);
        // "One drone" needs no number.
        for (const name of wanted) if (!given.has(name) && !(message.isPlural && name === 'n')) say(`lacks {${name}}`);
        for (const name of given) if (!wanted.has(name)) say(`has {${name}}, which the text has not`);
      }
    }
  }
  return faults;
}
