/** Changes the language of the console. Its texts are read once, so the page is loaded again. */

import type { LanguageChoice } from './languages/languages';
import { t } from './languages/text';
import type { User } from './link/wire_types';
import { reloadPage } from './reload_page';
import { chooseLanguage } from './user_choices.svelte';

export async function changeLanguage(choice: LanguageChoice, user: User): Promise<void> {
  await chooseLanguage(choice);
  await reloadPage(user, {
    title: t('Load the page in another language while you have controls?'),
    reason: t('If you wait, the next page that you load has the new language.'),
    confirmLabel: t('Load it now'),
  });
}
