/** Confirms arming: asks the pilot, and shows the check before flight where it is dangerous and not yet read. */

import { ask, type Question } from './confirmation.svelte';
import { t } from './languages/text';
import { mustBeRead } from './link/safety_types';
import type { Vehicle } from './link/vehicle';
import { tower } from './tower.svelte';

/**
 * Returns the acknowledgement to send to the tower before the motors turn once the pilot has agreed; null if the pilot
 * declined. `isAnswered`: the pilot has agreed already; only dangers are then asked about.
 */
export async function confirmArming(
  vehicle: Vehicle,
  question: Question,
  { isAnswered = false } = {},
): Promise<(() => Promise<void>) | null> {
  const { id, name } = vehicle.drone.get();
  // The check may have changed since the page opened. If the tower cannot be read, the known check still applies.
  await tower.readLossCheck(id).catch(() => undefined);
  const check = vehicle.lossCheck.get();
  if (!check || !mustBeRead(check)) return isAnswered || (await ask(question)) ? () => Promise.resolve() : null;
  const consent = await ask({
    ...question,
    sentences: check.sentences,
    confirmLabel: t('I have read this: arm {name} all the same', { name }),
    isDanger: true,
    // A press confirms a warning; a danger of dropping or losing the drone requires its name.
    nameToType: name,
  });
  return consent && (() => tower.acknowledgeLossCheck(id, name));
}
