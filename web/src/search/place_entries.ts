/** A coordinate typed into the search: the map goes there. */

import { readCoordinate } from '../coordinates/read_coordinate';
import { t } from '../languages/text';
import { mapTarget } from '../map_target.svelte';
import { middleShown } from '../map/shown_area';
import { monitorHref, navigation } from '../route.svelte';
import { latLon } from '../words/format';
import type { SearchEntry } from './search_entries';

const WITH_MAP: ReadonlySet<string> = new Set(['monitor', 'control', 'missions', 'squad-mission']);

export function placeEntries(text: string): SearchEntry[] {
  const place = readCoordinate(text, middleShown());
  if (!place) return [];
  const words = latLon(place);
  const run = (): void => {
    mapTarget.sought = { ...place, words };
    if (!WITH_MAP.has(navigation.route.page)) window.location.hash = monitorHref;
  };
  return [{ id: `place ${words}`, kind: 'place', label: t('Show {words} on the map', { words }), detail: '', run }];
}
