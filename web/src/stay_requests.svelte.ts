/** "Stay" requests: sent to the tower once, with the outcome shown wherever the drone's countdown is. */

import { SvelteMap } from 'svelte/reactivity';

import { t } from './languages/text';
import type { Drone } from './link/wire_types';
import { wordsOf } from './loading.svelte';
import { tower } from './tower.svelte';

export interface StayRequest {
  readonly phase: 'asking' | 'reported' | 'refused';
  /** For a refusal. */
  readonly words: string;
}

/** How long a refusal is shown; then the button returns. */
const REFUSAL_SHOWN_MS = 15_000;

export const stayRequests = new SvelteMap<number, StayRequest>();

export async function requestStay(drone: Drone): Promise<void> {
  if (stayRequests.get(drone.id)?.phase === 'asking') return;
  stayRequests.set(drone.id, { phase: 'asking', words: '' });
  try {
    await tower.control(drone.id, 'stay');
    stayRequests.set(drone.id, { phase: 'reported', words: '' });
  } catch (error) {
    const refusal: StayRequest = { phase: 'refused', words: wordsOf(error) };
    tower.record({
      droneId: drone.id,
      source: 'tower',
      severity: 'error',
      text: t('Stay refused: {refusal}', { refusal: refusal.words }),
    });
    stayRequests.set(drone.id, refusal);
    tower.clock.after(REFUSAL_SHOWN_MS, () => {
      if (stayRequests.get(drone.id) === refusal) stayRequests.delete(drone.id);
    });
  }
}

/** The countdown is over: the next one starts without the answer to this one. */
export const forgetStay = (droneId: number): boolean => stayRequests.delete(droneId);
