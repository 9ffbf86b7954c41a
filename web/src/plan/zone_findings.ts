/** What the tower says of zones on the way of a plan, as findings of the checks. Pure. */

import { t } from '../languages/text';
import { CMD, commandWords } from './catalogue';
import { partOfItem } from './part_of_item';
import type { Finding } from './plan_checks';
import type { Plan, PlanKind } from './plan_types';

/** `words` ends a sentence about the way: "leads into the no-fly zone Airport (reason)". */
export interface ZoneOnWay {
  /** From 0. */
  readonly item: number;
  readonly refuses: boolean;
  readonly words: string;
}

function wayTo(plan: Plan, kind: PlanKind, at: number): string {
  if (kind !== 'mission') return t('Flying to rally point {at}', { at: at + 1 });
  const command = plan.items[at]?.command;
  if (command === undefined) return t('The way to item {at}', { at: at + 1 });
  return command === CMD.JUMP
    ? t('The jump of item {at}', { at: at + 1 })
    : t('The way to item {at} ({command})', { at: at + 1, command: commandWords(command) });
}

/** `plan`: the one that the tower was asked about. */
export const zoneFindings = (plan: Plan, kind: PlanKind, zones: readonly ZoneOnWay[]): Finding[] =>
  zones.map(({ item, refuses, words }) => ({
    severity: refuses ? 'error' : 'warning',
    kind,
    part: partOfItem(plan, kind, item),
    words: `${wayTo(plan, kind, item)} ${words}.${refuses ? '' : ` ${t('This zone only warns.')}`}`,
  }));
