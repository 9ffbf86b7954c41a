/** Confirms arming: asks the pilot, and shows the check before flight where it is dangerous and not yet read. */

import { ask, LEAVES_OR_ENDS_S, type Question } from './confirmation.svelte';
import { t } from './languages/text';
import { PreflightRest } from './link/preflight';
import { mustBeRead } from './link/safety_types';
import type { Vehicle } from './link/vehicle';
import { tower } from './tower.svelte';
import { openWarnings } from './words/open_warnings';

/** What is open before this drone leaves the ground, as the tower says now. */
export async function warningsBefore(vehicle: Vehicle): Promise<string[]> {
  const { id } = vehicle.drone.get();
  const preflight = await new PreflightRest(tower.rest).of(id).catch(() => null);
  return openWarnings({ preflight, lossCheck: vehicle.lossCheck.get(), alerts: tower.alerts.of(id) });
}

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
  if (!check || !mustBeRead(check)) {
    const isAgreed =
      isAnswered || (await ask({ ...question, heldS: LEAVES_OR_ENDS_S, warnings: await warningsBefore(vehicle) }));
    return isAgreed ? () => Promise.resolve() : null;
  }
  const consent = await ask({
    ...question,
    sentences: check.sentences,
    confirmLabel: t('I have read this: arm {name} all the same', { name }),
    isDanger: true,
    heldS: LEAVES_OR_ENDS_S,
    // A press confirms a warning; a danger of dropping or losing the drone requires its name.
    nameToType: name,
  });
  return consent && (() => tower.acknowledgeLossCheck(id, name));
}
