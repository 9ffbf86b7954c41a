/** Names of the themes. */

import { t } from '../languages/text';
import type { ThemeChoice } from '../preferences.svelte';

export const THEMES: readonly { readonly value: ThemeChoice; readonly label: string }[] = [
  { value: 'system', label: t('As the system') },
  { value: 'dark', label: t('Dark') },
  { value: 'light', label: t('Light') },
  { value: 'contrast', label: t('High contrast, for the sun') },
];
