/** Changes who has the controls: asks first, saying what the drone will do, then sends the request. */

import { ask, type Consent, type Question } from './confirmation.svelte';
import { flightTask } from './link/modes';
import type { ControlAction, ControlWords } from './link/rest';
import type { Drone } from './link/wire_types';
import { tower } from './tower.svelte';

const AGREED: Consent = { reason: '', isChecked: true, isSecondChecked: true, isOther: false };

const pilotOf = (drone: Drone): string => drone.holder?.name ?? 'nobody';

/** What a hold does to the drone in its present state. */
function holdWords({ name, airborne, armed }: Drone): string {
  if (airborne === null && armed !== false) {
    return `It is not known whether ${name} is in the air. If it is, it will hold (sticks centred, its hold mode).`;
  }
  if (airborne) return `${name} is in the air. It will hold (sticks centred, its hold mode).`;
  return armed
    ? `${name} is on the ground with its motors running. It will hold, and the motors keep running.`
    : `${name} is on the ground with its motors off. Nothing happens.`;
}

/**
 * `asksViews`: the two checkboxes are about the views that the pilot keeps. Returns false when the user cancels. Raises
 * RestError with a message to display.
 */
async function change(drone: Drone, action: ControlAction, question?: Question, asksViews = false): Promise<boolean> {
  const consent = question ? await ask(question) : AGREED;
  if (!consent) return false;
  const words: ControlWords = consent.reason ? { reason: consent.reason } : {};
  const views: ControlWords = { watch: consent.isChecked, video: consent.isSecondChecked ? 'keep' : 'move' };
  const interrupts: ControlWords = consent.isOther ? { interrupt: true } : {};
  await tower.control(drone.id, action, asksViews ? { ...words, ...views, ...interrupts } : words);
  return true;
}

/**
 * An operator has one drone at a time: taking another is one question, and one release. An admin may have several.
 */
export async function acquire(drone: Drone): Promise<boolean> {
  const me = tower.user.get();
  const held = [...tower.vehicles.get().values()]
    .map((vehicle) => vehicle.drone.get())
    .find(({ id, holder }) => id !== drone.id && holder?.id === me?.id);
  if (!held || me?.role === 'admin') return change(drone, 'acquire');
  const flies = inFlight(held);
  const left =
    flies === false
      ? `${held.name} is on the ground.`
      : `${held.name} ${flies ? 'is' : 'may be'} in the air and will have no pilot. If flown by hand, it holds.`;
  const consent = await ask({
    title: `You control ${held.name}. Release it and take ${drone.name}?`,
    text: left,
    confirmLabel: `Release ${held.name}, take ${drone.name}`,
    isDanger: flies !== false,
  });
  if (!consent) return false;
  await tower.control(held.id, 'release', {});
  try {
    await tower.control(drone.id, 'acquire', {});
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    // Nobody asked for a drone without a pilot.
    const isBack = await tower.control(held.id, 'acquire', {}).then(
      () => true,
      () => false,
    );
    throw new Error(`${why} ${isBack ? `You still control ${held.name}.` : `${held.name} is released.`}`, {
      cause: error,
    });
  }
  return true;
}

/** In flight if the agent or the autopilot says so; null: unknown. */
function inFlight(drone: Drone): boolean | null {
  return tower.vehicles.get().get(drone.id)?.isAirborne(drone, tower.clock.nowMs()) ?? drone.airborne;
}

export const release = (drone: Drone): Promise<boolean> =>
  change(
    drone,
    'release',
    drone.airborne !== false
      ? {
          title: drone.airborne ? `Release ${drone.name} in flight?` : `Release ${drone.name}?`,
          text: `${drone.name} ${drone.airborne ? 'is' : 'may be'} in the air and will have no pilot. If flown by hand, it holds.`,
          confirmLabel: 'Release',
          isDanger: true,
        }
      : undefined,
  );

/** What the drone is doing on its own, if that is returning or landing; null otherwise. */
function goingHome(drone: Drone): string | null {
  const values = tower.vehicles.get().get(drone.id)?.values(tower.clock.nowMs());
  if (!values || values.armed === false) return null;
  const task = flightTask(values.autopilot, values.customMode);
  if (task !== 'return' && task !== 'landing') return null;
  return `${drone.name} is ${task === 'return' ? 'returning' : 'landing'} by itself (${values.mode})`;
}

function takeQuestion(drone: Drone): Question {
  const pilot = drone.holder?.name ?? 'The pilot';
  const loses = `${pilotOf(drone)} loses the controls; you get them`;
  const views = {
    reasonLabel: 'Reason (the pilot reads it)',
    checkLabel: `${pilot} may still watch ${drone.name}`,
    secondCheckLabel: `${pilot} may still watch the video of ${drone.name}`,
  };
  const title = `Take the controls of ${drone.name}?`;
  const going = goingHome(drone);
  if (going === null) {
    const text = `${holdWords(drone)} ${loses}.`;
    return { title, text, confirmLabel: 'Take the controls', isDanger: true, ...views };
  }
  return {
    title,
    text: `${going}. ${loses} either way. Let it finish, or stop it where it is.`,
    confirmLabel: 'Take control and let it finish',
    otherLabel: 'Interrupt: hold where it is',
    ...views,
  };
}

export const take = (drone: Drone): Promise<boolean> => change(drone, 'take', takeQuestion(drone), true);

/** Stops the drone whatever it is doing, a return or a landing included. */
export async function takeInEmergency(drone: Drone): Promise<boolean> {
  const going = goingHome(drone);
  const now = going === null ? '' : `${going}: that is interrupted. `;
  const consent = await ask({
    title: `Emergency: take ${drone.name} and stop it?`,
    text: `${now}${drone.name} stops and holds where it is, even during a return or a landing. ${pilotOf(drone)} loses the controls; you get them.`,
    confirmLabel: `Take ${drone.name} and stop it`,
    isDanger: true,
    reasonLabel: 'Reason (the pilot reads it)',
  });
  if (!consent) return false;
  const reason = consent.reason ? { reason: consent.reason } : {};
  await tower.control(drone.id, 'take', { ...reason, interrupt: true });
  return true;
}

/** Withdraws the user's own offer. */
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
