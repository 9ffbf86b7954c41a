/** Taking up free controls from a card, a row or the flight bar. `mayTakeUp` says whether one may. */

import { acquire } from './control_actions';
import type { Drone } from './link/wire_types';
import { wordsOf } from './loading.svelte';

/** `tell`: gets why it was not possible, and '' when it is tried anew. */
export async function takeUp(drone: Drone, tell: (problem: string) => void): Promise<void> {
  tell('');
  try {
    await acquire(drone);
  } catch (error) {
    tell(wordsOf(error));
  }
}
