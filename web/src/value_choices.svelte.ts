/** Which values the user sees of each kind of drone; the tower keeps them for the user. */

import { KeptDocument } from './kept_document.svelte';
import { readChoices } from './values/value_layout';

export const valueChoices = new KeptDocument('values', readChoices);
