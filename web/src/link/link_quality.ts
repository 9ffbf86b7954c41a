/** A drone's link quality, completed from the tower's report: an older tower sends only two numbers. */

import type { LinkOver, LinkQuality } from './wire_types';

export interface QualityOver {
  readonly rttMs: number | null;
  readonly jitterMs: number | null;
  /** From the drone to the tower, and back. */
  readonly lossUpPercent: number | null;
  readonly lossDownPercent: number | null;
}

/** From "safe to fly by hand" to "expect to lose it". */
export type LinkGrade = 'good' | 'fair' | 'poor' | 'bad';

export interface LinkReading {
  readonly grade: LinkGrade;
  readonly over1s: QualityOver;
  readonly over30s: QualityOver;
  readonly pathMtuBytes: number | null;
  readonly transport: string | null;
  readonly uplinks: number | null;
}

const UNKNOWN: QualityOver = { rttMs: null, jitterMs: null, lossUpPercent: null, lossDownPercent: null };

/** The worse of the two decides. Above 500 ms the tower makes a drone that is flown by hand hold. */
export const GRADES: readonly { readonly grade: LinkGrade; readonly rttMs: number; readonly lossPercent: number }[] = [
  { grade: 'good', rttMs: 150, lossPercent: 2 },
  { grade: 'fair', rttMs: 300, lossPercent: 8 },
  { grade: 'poor', rttMs: 500, lossPercent: 20 },
];

/** An older tower omits the newer fields. */
export type QualityOnWire = Pick<LinkQuality, 'rtt_ms' | 'loss'> & Partial<LinkQuality>;

export function readLink(event: QualityOnWire): LinkReading {
  const over1s = event.over_1s
    ? quality(event.over_1s)
    : { ...UNKNOWN, rttMs: event.rtt_ms, lossUpPercent: event.loss * 100 };
  const over30s = event.over_30s ? quality(event.over_30s) : UNKNOWN;
  const rttMs = over1s.rttMs ?? event.rtt_ms ?? 0;
  const lossPercent = Math.max(event.loss * 100, over30s.lossUpPercent ?? 0, over30s.lossDownPercent ?? 0);
  const fits = GRADES.find((one) => rttMs <= one.rttMs && lossPercent <= one.lossPercent);
  return {
    grade: fits?.grade ?? 'bad',
    over1s,
    over30s,
    pathMtuBytes: event.path_mtu ?? null,
    transport: event.transport ?? null,
    uplinks: event.uplinks ?? null,
  };
}

function quality(over: LinkOver): QualityOver {
  const percent = (share: number | null): number | null => (share === null ? null : share * 100);
  return {
    rttMs: over.rtt_ms,
    jitterMs: over.jitter_ms,
    lossUpPercent: percent(over.loss_up),
    lossDownPercent: percent(over.loss_down),
  };
}
