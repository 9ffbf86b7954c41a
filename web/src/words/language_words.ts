/** Names of the languages: each in its own words, for whoever reads no other. */

import { LANGUAGE_NAMES, OFFERED, type LanguageChoice } from '../languages/languages';
import { t } from '../languages/text';

export const LANGUAGE_CHOICES: readonly { readonly value: LanguageChoice; readonly label: string }[] = [
  { value: 'system', label: t('As the browser') },
  ...OFFERED.map((value) => ({ value, label: LANGUAGE_NAMES[value] })),
];
