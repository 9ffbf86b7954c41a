/** The questions before a squad mission is uploaded, started and held. Pure. */

import { t } from '../languages/text';

interface Question {
  readonly title: string;
  readonly text: string;
  readonly confirmLabel: string;
  readonly isDanger?: boolean;
}

/** `names`: of the drones; `count`: how many they are. */
export const uploadQuestion = (names: string, count: number): Question => ({
  title: t('Upload to {names}?', { names }),
  text: t(
    'This replaces the mission of each drone: {names}. They are uploaded one after the other. You hold the controls of each free drone during its upload.',
    { names },
  ),
  confirmLabel: t('Upload to {count}', { count }),
});

/** `errors`: found in the plans, in words. `startEveryS`: seconds between two starts. */
export function startQuestion(names: string, count: number, startEveryS: number, errors: readonly string[]): Question {
  const warned =
    errors.length > 0
      ? ` ${t('{count} errors were found in these plans: {first}', { count: errors.length, first: errors[0] })}`
      : '';
  return {
    title: t('Start {names}?', { names }),
    text: t(
      '{names} start their motors, take off and fly their missions, one {startEveryS} s after the other. Afterwards nobody has the controls: take control of one to intervene, or press "Hold all".{warned}',
      { names, startEveryS, warned },
    ),
    confirmLabel: t('Start {count}', { count }),
    isDanger: true,
  };
}

export const holdQuestion = (names: string, count: number): Question => ({
  title: t('Hold {names}?', { names }),
  text: t(
    '{names} stop and stay where they are, in the air, until somebody flies them. Drones on the ground stay there.',
    { names },
  ),
  confirmLabel: t('Hold {count}', { count }),
  isDanger: true,
});
