/** Before motors turn: the question, and with it the check before flight where that is dangerous and not yet read. */

import { ask, type Question } from './confirmation.svelte';
import { wantsReading } from './link/safety_types';
import type { Vehicle } from './link/vehicle';
import { tower } from './tower.svelte';

/** What to say to the tower before the motors turn, once the pilot has agreed; null when they have not. */
export async function agreeToArm(vehicle: Vehicle, question: Question): Promise<(() => Promise<void>) | null> {
  const { id, name } = vehicle.drone.get();
  // What was read when the page opened may have changed. A tower that cannot say is no reason to ask less.
  await tower.readLossCheck(id).catch(() => undefined);
  const check = vehicle.lossCheck.get();
  if (!check || !wantsReading(check)) return (await ask(question)) ? () => Promise.resolve() : null;
  const consent = await ask({
    ...question,
    sentences: check.sentences,
    confirmLabel: `I have read this: arm ${name} all the same`,
    isDanger: true,
    // A warning may be agreed to by a press; what could drop or lose the drone wants its name.
    nameToType: name,
  });
  return consent && (() => tower.acknowledgeLossCheck(id, name));
}
