/** What is open before a drone leaves the ground, a sentence each, the worst first: beside each button that starts. Pure. */

import { plural, t } from '../languages/text';
import type { Alert } from '../link/alerts';
import type { LineState, Preflight } from '../link/preflight';
import type { LossCheck } from '../link/safety_types';

export interface BeforeTakeOff {
  /** Null: not read. */
  readonly preflight: Pick<Preflight, 'lines' | 'own' | 'signed'> | null;
  readonly lossCheck: Pick<LossCheck, 'sentences' | 'complete'> | null;
  /** The open ones of the drone. */
  readonly alerts: readonly Alert[];
}

const ORDER: readonly LineState[] = ['bad', 'caution', 'unknown'];
/** The line of the checklist that repeats the check before flight. */
const LOSS_LINE = 'failsafes';

export function openWarnings({ preflight, lossCheck, alerts }: BeforeTakeOff): string[] {
  const found = alerts.filter(({ severity }) => severity !== 'notice').map(({ words }) => words);
  const dangers = (lossCheck?.sentences ?? []).filter(({ severity }) => severity === 'danger');
  found.push(...dangers.map(({ text }) => text));
  if (preflight === null) return [...found, t('The preflight checklist could not be read.')];
  for (const state of ORDER) {
    const lines = preflight.lines.filter((line) => line.state === state);
    found.push(
      ...lines
        .filter(({ key }) => key !== LOSS_LINE || dangers.length === 0)
        .map(({ title, words }) => `${title}: ${words}`),
    );
  }
  if (preflight.signed === null && preflight.own.length > 0) {
    found.push(
      plural(preflight.own.length, {
        one: '{n} checklist item is not confirmed.',
        other: '{n} checklist items are not confirmed.',
      }),
    );
  }
  return [...new Set(found)];
}
