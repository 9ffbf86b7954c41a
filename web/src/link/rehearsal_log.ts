/** The displayed state of a rehearsal: its end must not erase what it has shown. */

import type { RehearsalEvent } from './wire_types';

export interface Rehearsal extends RehearsalEvent {
  /** The loss still lasts, or its outcome is pending: no other rehearsal can begin. */
  readonly isRunning: boolean;
}

/** Outcomes that say more than "over". */
const LASTING_PHASES: ReadonlySet<string> = new Set(['failed', 'not_needed']);

export function nextRehearsal(last: Rehearsal | null, event: RehearsalEvent): Rehearsal {
  if (event.phase !== 'ended') return { ...event, isRunning: true };
  if (last === null || last.what !== event.what) return { ...event, isRunning: false };
  if (LASTING_PHASES.has(last.phase)) return { ...last, isRunning: false };
  return { ...event, hold_ms: event.hold_ms ?? last.hold_ms, text: last.text, isRunning: false };
}
