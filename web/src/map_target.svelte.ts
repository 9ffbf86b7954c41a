/** A place that somebody searched for: the map of the page goes there and marks it. */

import type { Place } from './link/messages';

export interface SoughtPlace extends Place {
  readonly words: string;
}

export const mapTarget = $state<{ sought: SoughtPlace | null }>({ sought: null });
