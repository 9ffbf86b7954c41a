/** Which map the user wants to see. */

import { KeptDocument } from './kept_document.svelte';
import { readChoice } from './map/map_layers';

export const mapChoice = new KeptDocument('map', readChoice);
