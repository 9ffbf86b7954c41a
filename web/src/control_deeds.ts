/** Changing who has the controls: the question, which says what will happen to the drone, and then the deed. */

import { ask, type Question } from './confirmation.svelte';
import type { ControlAction, ControlWords } from './link/rest';
import type { Drone } from './link/wire_types';
import { tower } from './tower.svelte';

const pilotOf = (drone: Drone): string => drone.holder?.name ?? 'nobody';

/** What a hold does to it as it is now. */
function holdWords({ name, airborne, armed }: Drone): string {
  if (airborne) return `${name} is in the air: it is put on hold (sticks centred, its hold mode).`;
  return armed
    ? `${name} is on the ground with its motors running: it is put on hold, and they go on running.`
    : `${name} is on the ground with its motors off: it does nothing.`;
}

/** `asksViews`: the two checks are about what the pilot may still see. False when the user thought better of it. Raises RestError with words to show. */
async function change(drone: Drone, action: ControlAction, question?: Question, asksViews = false): Promise<boolean> {
  const consent = question ? await ask(question) : { reason: '', isChecked: true, isSecondChecked: true };
  if (!consent) return false;
  const words: ControlWords = consent.reason ? { reason: consent.reason } : {};
  const views: ControlWords = { watch: consent.isChecked, video: consent.isSecondChecked ? 'keep' : 'move' };
  await tower.control(drone.id, action, asksViews ? { ...words, ...views } : words);
  return true;
}

export const acquire = (drone: Drone): Promise<boolean> => change(drone, 'acquire');

export const release = (drone: Drone): Promise<boolean> =>
  change(
    drone,
    'release',
    drone.airborne
      ? {
          title: `Release ${drone.name} in flight?`,
          text: `${drone.name} is in the air and nobody will have its controls. Flown by hand, it is put on hold.`,
          confirmLabel: 'Release',
          isDanger: true,
        }
      : undefined,
  );

export function take(drone: Drone): Promise<boolean> {
  const pilot = drone.holder?.name ?? 'The pilot';
  const question: Question = {
    title: `Take the controls of ${drone.name}?`,
    text: `${holdWords(drone)} ${pilotOf(drone)} loses the controls and you get them.`,
    confirmLabel: 'Take the controls',
    isDanger: true,
    reasonLabel: 'Reason (the pilot reads it)',
    checkLabel: `${pilot} may still watch ${drone.name}`,
    secondCheckLabel: `${pilot} may still watch the video of ${drone.name}`,
  };
  return change(drone, 'take', question, true);
}

/** Withdraws an offer of one's own. */
export const keep = (drone: Drone): Promise<boolean> => change(drone, 'take');

export function give(drone: Drone): Promise<boolean> {
  const pilot = drone.taken_from?.name ?? 'its pilot';
  return change(drone, 'give', {
    title: `Give ${drone.name} back to ${pilot}?`,
    text: `${holdWords(drone)} It stays yours until ${pilot} accepts with centred sticks.`,
    confirmLabel: 'Give back',
    reasonLabel: 'Reason (optional)',
  });
}

export const assist = (drone: Drone): Promise<boolean> =>
  change(drone, 'assist', {
    title: `Assist ${pilotOf(drone)} with ${drone.name}?`,
    text: `${pilotOf(drone)} keeps ${drone.name}, which flies on. When you command something, ${pilotOf(drone)}'s commands wait until 1 s after it.`,
    confirmLabel: 'Assist',
    reasonLabel: 'Reason (optional)',
  });

export const unassist = (drone: Drone): Promise<boolean> => change(drone, 'unassist');
