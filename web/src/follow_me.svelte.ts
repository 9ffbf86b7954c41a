/**
 * "Follow me": a drone follows the person at this browser. Reads the position once a second and reports it to the tower
 * as long as the drone follows, whatever page is open. A closed page stops reporting, and then the drone holds.
 */

import { ask } from './confirmation.svelte';
import { t } from './languages/text';
import { followPerson, begunOrEnded } from './link/drone_commands';
import { isOver } from './link/operations';
import { ageMs, sureM, type Located } from './link/person_fix';
import type { Vehicle } from './link/vehicle';
import { preferences } from './preferences.svelte';
import { FOLLOW_FOR_S } from './squad/follow_place';
import { tower } from './tower.svelte';
import { measured } from './words/units';

const EVERY_MS = 1_000;
/** The first fix takes longer: an idle receiver must find satellites. */
const FIRST_WITHIN_MS = 20_000;
/** After this the drone holds anyway. */
const WITHIN_MS = 2_500;

/** What this browser reports at present; `operationId` null: nothing. */
export const sharing = $state<{ operationId: string | null; accuracyM: number | null; problem: string }>({
  operationId: null,
  accuracyM: null,
  problem: '',
});

/** Why this browser cannot report its position; empty if it can. */
export function whyNoPlace(): string {
  if (!window.isSecureContext)
    return t('Browsers share their position over https only. Open this tower by its https address to use "Follow me".');
  return 'geolocation' in navigator ? '' : t('This browser does not know its position.');
}

const FAULTS: Record<number, string> = {
  1: t('This browser may not share its position. Allow it in the site settings.'),
  2: t('This browser does not know its position.'),
  3: t('This browser did not give its position in time.'),
};

function locate(timeoutMs: number): Promise<Located> {
  return new Promise((resolve, reject) => {
    navigator.geolocation.getCurrentPosition(
      resolve,
      ({ code, message }) => reject(new Error(FAULTS[code] ?? message)),
      { enableHighAccuracy: true, maximumAge: 0, timeout: timeoutMs },
    );
  });
}

const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** What makes the drone hold; for the question and for those who watch. */
export const personEndWords = (): string => {
  const { units } = preferences;
  return t(
    'It holds where it is if this browser is silent for 3 s, is closed or loses the tower, if you come nearer than {distance}, or after {followFor} minutes. Any other command, and moved sticks, end it too.',
    { distance: measured(units, 'distance', 5), followFor: FOLLOW_FOR_S / 60 },
  );
};

/** Reads the person's position, asks them to confirm, then asks the tower. The result appears in the action report. */
export async function followMe(vehicle: Vehicle, awayM: number, altRelM: number | null): Promise<void> {
  const { id, name } = vehicle.drone.get();
  const { units } = preferences;
  let first: Located;
  try {
    first = await locate(FIRST_WITHIN_MS);
  } catch (error) {
    const words = wordsOf(error);
    await vehicle.perform(t('Follow me'), () => Promise.resolve({ kind: 'reported', isDone: false, words }));
    return;
  }
  const sure = measured(units, 'distance', first.coords.accuracy);
  const needed = measured(units, 'distance', sureM(awayM));
  const height = measured(units, 'height', altRelM, 0);
  const text = t(
    '{name} stays on the side of you on which it is now, {distance} away over ground and {height} above home, and flies as you go. It does not see trees or rising ground. Your position is accurate to {sure}; what is less sure than {needed} does not count. {personEnd}',
    { name, distance: measured(units, 'distance', awayM), height, sure, needed, personEnd: personEndWords() },
  );
  if (
    !(await ask({ title: t('Have {name} follow you?', { name }), text, confirmLabel: t('Follow me'), isDanger: true }))
  )
    return;
  await vehicle.perform(t('Follow me'), async () => {
    try {
      const now = await locate(FIRST_WITHIN_MS); // the question may have been open for long
      const begun = await followPerson(tower.operations, id, {
        command: 'follow_me',
        lat: now.coords.latitude,
        lon: now.coords.longitude,
        accuracy_m: now.coords.accuracy,
        age_ms: ageMs(now, Date.now()),
        distance_m: awayM,
        for_s: FOLLOW_FOR_S,
      });
      void report(id, begun.id);
      const came = await begunOrEnded(tower.operations, begun.id);
      const follows = came !== null && !isOver(came);
      return {
        kind: 'reported',
        isDone: follows,
        words: follows ? t('{name} follows you.', { name }) : came?.words || t('It ended at once.'),
      };
    } catch (error) {
      return { kind: 'reported', isDone: false, words: wordsOf(error) };
    }
  });
}

/** Until the drone stops following, or follows in another operation. */
async function report(droneId: number, operationId: string): Promise<void> {
  Object.assign(sharing, { operationId, accuracyM: null, problem: '' });
  const follows = (): boolean => {
    const one = tower.operations.all.get().get(operationId);
    return sharing.operationId === operationId && one !== undefined && !isOver(one);
  };
  while (follows()) {
    const beganMs = performance.now();
    try {
      const located = await locate(WITHIN_MS);
      if (!follows()) break;
      tower.live.reportPlace(droneId, located);
      Object.assign(sharing, { accuracyM: located.coords.accuracy, problem: '' });
    } catch (error) {
      sharing.problem = wordsOf(error);
    }
    await new Promise((resolve) => setTimeout(resolve, Math.max(0, EVERY_MS - (performance.now() - beganMs))));
  }
  if (sharing.operationId === operationId) sharing.operationId = null;
}
