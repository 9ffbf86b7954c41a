/** What a missing tile of imagery raises, so that the map stretches a coarser one. It is no fault. */
export const MISSING_TILE = 'No tile here';
