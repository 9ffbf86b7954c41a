/** Takes free controls from a card, a row or the flight bar. `mayTakeFree` says whether one may. */

import type { Drone } from './link/wire_types';
import { wordsOf } from './loading.svelte';

/** `tell`: gets why it was not possible, and '' when it is tried anew. */
export async function takeControl(drone: Drone, tell: (problem: string) => void): Promise<void> {
  tell('');
  try {
    // Its questions come with the Control page, which loads when the console is idle.
    const { acquire } = await import('./control_actions');
    await acquire(drone);
  } catch (error) {
    tell(wordsOf(error));
  }
}
