/** Changes who has the controls: asks first, saying what the drone will do, then sends the request. */

import { ask, type Consent, type Question } from './confirmation.svelte';
import { t } from './languages/text';
import type { ControlAction, ControlWords } from './link/rest';
import type { Drone } from './link/wire_types';
import { tower } from './tower.svelte';

const AGREED: Consent = { reason: '', isChecked: true, isSecondChecked: true, isOther: false };

const pilotOf = (drone: Drone): string => drone.holder?.name ?? t('nobody');

/** What a hold does to the drone in its present state. */
function holdWords({ name, airborne, armed, watched_only }: Drone): string {
  if (watched_only) return t('{name} is watched only: it is sent nothing, and goes on as it does now.', { name });
  if (airborne === null && armed !== false) {
    return t('It is not known whether {name} is in the air. If it is, it will hold (sticks centred, its hold mode).', {
      name,
    });
  }
  if (airborne) return t('{name} is in the air. It will hold (sticks centred, its hold mode).', { name });
  return armed
    ? t(
        '{name} is on the ground with its motors running. It will hold, and the autopilot stops the motors after its own delay.',
        { name },
      )
    : t('{name} is on the ground with its motors off. Nothing happens.', { name });
}

/** What a drone does that loses its pilot in the air. */
function unpilotedWords({ name, airborne, watched_only, lost_action, lost_action_s: seconds }: Drone): string {
  if (watched_only) return t('{name} is watched only: without a pilot nothing holds it.', { name });
  const now = airborne
    ? t('{name} is in the air and will have no pilot. If flown by hand, it holds.', { name })
    : t('{name} may be in the air and will have no pilot. If flown by hand, it holds.', { name });
  if (lost_action === 'return')
    return `${now} ${t('Unless it flies a mission, it returns after {seconds} s.', { seconds })}`;
  if (lost_action === 'land')
    return `${now} ${t('Unless it flies a mission, it lands after {seconds} s.', { seconds })}`;
  return now;
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
    flies === false ? t('{held} is on the ground.', { held: held.name }) : unpilotedWords({ ...held, airborne: flies });
  const consent = await ask({
    title: t('You control {held}. Release it and take control of {drone}?', { held: held.name, drone: drone.name }),
    text: left,
    confirmLabel: t('Release {held}, take control of {drone}', { held: held.name, drone: drone.name }),
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
    throw new Error(
      `${why} ${isBack ? t('You still control {held}.', { held: held.name }) : t('{held} is released.', { held: held.name })}`,
      {
        cause: error,
      },
    );
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
          title: drone.airborne
            ? t('Release {drone} in flight?', { drone: drone.name })
            : t('Release {drone}?', { drone: drone.name }),
          text: unpilotedWords(drone),
          confirmLabel: t('Release'),
          isDanger: true,
        }
      : undefined,
  );

/** What the drone is doing on its own, if that is returning or landing; null otherwise. */
function goingHome(drone: Drone): string | null {
  const values = tower.vehicles.get().get(drone.id)?.values(tower.clock.nowMs());
  if (!values || values.armed === false) return null;
  const { task } = values;
  if (task !== 'return' && task !== 'landing') return null;
  return task === 'return'
    ? t('{drone} is returning by itself ({mode})', { drone: drone.name, mode: values.mode })
    : t('{drone} is landing by itself ({mode})', { drone: drone.name, mode: values.mode });
}

function takeQuestion(drone: Drone): Question {
  const pilot = drone.holder?.name ?? t('The pilot');
  const loses = t('{pilotOf} loses the controls; you get them', { pilotOf: pilotOf(drone) });
  const views = {
    reasonLabel: t('Reason (the pilot reads it)'),
    checkLabel: t('{pilot} may still watch {drone}', { pilot, drone: drone.name }),
    secondCheckLabel: t('{pilot} may still watch the video of {drone}', { pilot, drone: drone.name }),
  };
  const title = t('Take control of {drone}?', { drone: drone.name });
  const going = goingHome(drone);
  if (going === null) {
    const text = `${holdWords(drone)} ${loses}.`;
    return { title, text, confirmLabel: t('Take control'), isDanger: true, ...views };
  }
  return {
    title,
    text: t('{going}. {loses} either way. Let it finish, or stop it where it is.', { going, loses }),
    confirmLabel: t('Take control and let it finish'),
    otherLabel: t('Interrupt: hold where it is'),
    ...views,
  };
}

export const take = (drone: Drone): Promise<boolean> => change(drone, 'take', takeQuestion(drone), true);

/** Stops the drone whatever it is doing, a return or a landing included. */
export async function takeInEmergency(drone: Drone): Promise<boolean> {
  const going = goingHome(drone);
  const now = going === null ? '' : `${t('{going}: that is interrupted.', { going })} `;
  const consent = await ask({
    title: t('Emergency: take control of {drone} and stop it?', { drone: drone.name }),
    text: drone.watched_only
      ? `${holdWords(drone)} ${t('{pilotOf} loses the controls; you get them', { pilotOf: pilotOf(drone) })}.`
      : t(
          '{now}{drone} stops and holds where it is, even during a return or a landing. {pilotOf} loses the controls; you get them.',
          { now, drone: drone.name, pilotOf: pilotOf(drone) },
        ),
    confirmLabel: t('Take control of {drone} and stop it', { drone: drone.name }),
    isDanger: true,
    reasonLabel: t('Reason (the pilot reads it)'),
  });
  if (!consent) return false;
  const reason = consent.reason ? { reason: consent.reason } : {};
  await tower.control(drone.id, 'take', { ...reason, interrupt: true });
  return true;
}

/** Withdraws the user's own offer. */
export const keep = (drone: Drone): Promise<boolean> => change(drone, 'take');

export function give(drone: Drone): Promise<boolean> {
  const pilot = drone.taken_from?.name ?? t('its pilot');
  return change(drone, 'give', {
    title: t('Give {drone} back to {pilot}?', { drone: drone.name, pilot }),
    text: t('{hold} It stays yours until {pilot} accepts with centred sticks.', { hold: holdWords(drone), pilot }),
    confirmLabel: t('Give back'),
    reasonLabel: t('Reason (optional)'),
  });
}

export const assist = (drone: Drone): Promise<boolean> =>
  change(drone, 'assist', {
    title: t('Assist {pilotOf} with {drone}?', { pilotOf: pilotOf(drone), drone: drone.name }),
    text: t(
      "{pilotOf} keeps {drone}, which flies on. When you command something, {pilotOf}'s commands wait until 1 s after it.",
      { pilotOf: pilotOf(drone), drone: drone.name },
    ),
    confirmLabel: t('Assist'),
    reasonLabel: t('Reason (optional)'),
  });

export const unassist = (drone: Drone): Promise<boolean> => change(drone, 'unassist');
