/** The newest hold of one drone, step by step. Pure: the next log from the last log and an event. */

import { orderReason } from './event_words';
import type { HoldEvent } from './wire_types';

export type HoldPhase = 'running' | 'confirmed' | 'not_needed' | 'unconfirmed';

export interface HoldStep {
  readonly step: string;
  readonly detail: string;
  readonly elapsedMs: number;
}

export interface HoldLog {
  readonly epoch: number;
  readonly cause: string;
  /** Of an order, as the tower said it; empty if this page did not hear it. */
  readonly reason: string;
  readonly steps: readonly HoldStep[];
  readonly phase: HoldPhase;
  /** Time from the order to the confirmation; null until then. */
  readonly confirmedMs: number | null;
  readonly beganMs: number;
  readonly changedMs: number;
}

export const FINAL_STEPS: ReadonlySet<string> = new Set(['confirmed', 'not_needed', 'unconfirmed']);
/** Limits repeated steps (a hold that is retried again and again); the newest are the most useful. */
const MAX_STEPS = 12;

export function nextHold(last: HoldLog | null, event: HoldEvent, nowMs: number): HoldLog {
  const cause = event.cause ?? 'order';
  const isSameOrder = last !== null && last.epoch === event.epoch && last.cause === cause && event.step !== 'ordered';
  const goesOn = isSameOrder && !beginsAnew(last);
  const step: HoldStep = { step: event.step, detail: event.detail, elapsedMs: event.elapsed_ms };
  const steps = [...(goesOn ? last.steps : []), step].slice(-MAX_STEPS);
  return {
    epoch: event.epoch,
    cause,
    // Two orders of one TAKE are confirmed one after the other: the second confirmation has the same reason.
    reason: isSameOrder ? last.reason : orderReason(event),
    steps,
    phase: FINAL_STEPS.has(event.step) ? (event.step as HoldPhase) : goesOn ? last.phase : 'running',
    confirmedMs: event.step === 'confirmed' ? event.elapsed_ms : goesOn ? last.confirmedMs : null,
    beganMs: goesOn ? last.beganMs : nowMs,
    changedMs: nowMs,
  };
}

/** `ordered` opens a hold; after its end, so does any other step, except that an unconfirmed hold may be confirmed. */
const beginsAnew = (last: HoldLog): boolean => last.phase === 'confirmed' || last.phase === 'not_needed';
