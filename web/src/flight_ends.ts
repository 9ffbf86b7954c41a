/**
 * What ends a flight. Held for a second (docs/console.md, "Confirmation"): by the button itself (`isHeld`), else by the
 * one of the question.
 */

import { ask, LEAVES_OR_ENDS_S } from './confirmation.svelte';
import { t } from './languages/text';
import type { Vehicle } from './link/vehicle';

export const returnWords = (name: string): string => t('{name} flies back to its home and lands there.', { name });
export const landWords = (name: string): string => t('{name} lands where it is now.', { name });

export async function returnHome(vehicle: Vehicle, { isHeld = false } = {}): Promise<void> {
  const { name } = vehicle.drone.get();
  const question = { title: t('Return {name}?', { name }), text: returnWords(name), confirmLabel: t('Return') };
  if (isHeld || (await ask({ ...question, heldS: LEAVES_OR_ENDS_S }))) {
    await vehicle.command(t('Return'), { command: 'rtl' });
  }
}

export async function land(vehicle: Vehicle, { isHeld = false } = {}): Promise<void> {
  const { name } = vehicle.drone.get();
  const question = { title: t('Land {name} here?', { name }), text: landWords(name), confirmLabel: t('Land') };
  if (isHeld || (await ask({ ...question, heldS: LEAVES_OR_ENDS_S }))) {
    await vehicle.command(t('Land'), { command: 'land' });
  }
}
