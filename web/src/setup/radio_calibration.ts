/** Learns the range of each channel of a radio while the pilot moves every stick and switch. Pure. */

import type { MessageFields } from '../link/generated/mavlink.gen';

export const MAX_CHANNELS = 16;
/** Outside of it a receiver reports a fault, or nothing. */
const LEAST_PWM = 800;
const MOST_PWM = 2200;
/** Less travel is no stick that was moved. */
export const LEAST_TRAVEL = 200;

export interface Channel {
  /** From 1. */
  readonly number: number;
  readonly now: number;
  readonly min: number;
  readonly max: number;
}

/** The channels of a message that a receiver really sends, in microseconds. */
export function channelsOf(fields: MessageFields['RC_CHANNELS']): readonly { number: number; now: number }[] {
  const raw = fields as unknown as Record<string, number>;
  return [...Array(Math.min(fields.chancount, MAX_CHANNELS)).keys()]
    .map((at) => ({ number: at + 1, now: raw[`chan${at + 1}_raw`] ?? 0 }))
    .filter(({ now }) => now >= LEAST_PWM && now <= MOST_PWM);
}

/** The channels after one more message. Without `learns` only their present values follow. */
export function moved(
  before: readonly Channel[],
  fields: MessageFields['RC_CHANNELS'],
  learns: boolean,
): readonly Channel[] {
  return channelsOf(fields).map(({ number, now }) => {
    const old = before.find((one) => one.number === number);
    if (!old) return { number, now, min: now, max: now };
    return learns ? { number, now, min: Math.min(old.min, now), max: Math.max(old.max, now) } : { ...old, now };
  });
}

/** Begins to learn anew from where the sticks are. */
export const fresh = (channels: readonly Channel[]): readonly Channel[] =>
  channels.map(({ number, now }) => ({ number, now, min: now, max: now }));

export const isMoved = ({ min, max }: Channel): boolean => max - min >= LEAST_TRAVEL;

/**
 * Parameters to write for the channels that were moved, with every stick centred and the throttle (`throttleChannel`)
 * at its bottom now.
 */
export function calibrated(channels: readonly Channel[], throttleChannel: number): Readonly<Record<string, number>> {
  const values: Record<string, number> = {};
  for (const channel of channels.filter(isMoved)) {
    const { number, now, min, max } = channel;
    values[`RC${number}_MIN`] = min;
    values[`RC${number}_MAX`] = max;
    values[`RC${number}_TRIM`] = number === throttleChannel ? min : Math.min(Math.max(now, min), max);
  }
  return values;
}
