/** The delay before the next attempt to reach the tower: doubles each time, with random spread. */

const FIRST_MS = 500;
const MAX_MS = 8_000;

/**
 * Between half and all of the nominal delay after this many failures in a row (from 1), so that browsers do not all
 * return at once after a restart of the tower. `random`: 0..1.
 */
export function backoffMs(failures: number, random: () => number = Math.random): number {
  const mostMs = Math.min(MAX_MS, FIRST_MS * 2 ** Math.min(failures - 1, 10));
  return mostMs * (0.5 + 0.5 * random());
}
