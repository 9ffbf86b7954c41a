/** What is to be seen of a rehearsal: its end must not wipe out what it has shown. */

import type { RehearsalEvent } from './wire_types';

export function nextRehearsal(last: RehearsalEvent | null, event: RehearsalEvent): RehearsalEvent {
  if (event.phase !== 'ended' || last === null || last.what !== event.what) return event;
  if (last.phase === 'failed') return last;
  return { ...event, hold_ms: event.hold_ms ?? last.hold_ms, text: last.text };
}
