/** Before motors turn: the question, and with it the check before flight where that is dangerous and not yet read. */

import { ask, type Question } from './confirmation.svelte';
import type { Outcome } from './link/commands';
import type { Flying } from './link/flying';
import { wantsReading } from './link/safety_types';
import type { Vehicle } from './link/vehicle';
import { tower } from './tower.svelte';

type Deed = (flying: Flying) => Promise<Outcome>;

/** What to do with a deed that arms, once the pilot has agreed; null when they have not. */
export async function askToArm(vehicle: Vehicle, question: Question): Promise<((deed: Deed) => Deed) | null> {
  const { id, name } = vehicle.drone.get();
  // What was read when the page opened may have changed. A tower that cannot say is no reason to ask less.
  await tower.readLossCheck(id).catch(() => undefined);
  const check = vehicle.lossCheck.get();
  if (!check || !wantsReading(check)) return (await ask(question)) ? (deed) => deed : null;
  const consent = await ask({
    ...question,
    sentences: check.sentences,
    confirmLabel: `I have read this: arm ${name} all the same`,
    isDanger: true,
  });
  if (!consent) return null;
  return (deed) => async (flying) => {
    try {
      await tower.acknowledgeLossCheck(id);
    } catch (error) {
      return { kind: 'failed', why: error instanceof Error ? error.message : String(error) };
    }
    return deed(flying);
  };
}
