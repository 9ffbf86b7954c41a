/** The fixed heights of the squad list's rows, in pixels: only those in sight are drawn. */

import { phone } from '../phone.svelte';

export const squadRowPx = (): number => (phone.isNarrow ? 156 : 112);
export const compactRowPx = (): number => (phone.isNarrow ? 46 : 36);
export const tableRowPx = (): number => (phone.isNarrow ? 46 : 32);
