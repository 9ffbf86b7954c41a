/** How long whoever lost the tower waits before the next try: twice as long each time, and spread. */

const FIRST_MS = 500;
const MAX_MS = 8_000;

/**
 * Between half and the whole of what it is for so many failures in a row (from 1 on), so that not all browsers come
 * back at once after a restart of the tower. `random`: 0..1.
 */
export function backoffMs(failures: number, random: () => number = Math.random): number {
  const mostMs = Math.min(MAX_MS, FIRST_MS * 2 ** Math.min(failures - 1, 10));
  return mostMs * (0.5 + 0.5 * random());
}
