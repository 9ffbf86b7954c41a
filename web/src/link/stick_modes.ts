/** Stick modes 1 to 4: which stick controls which axis. */

import type { Axes } from './sticks';

/** The four directions of two sticks; right and up are positive. */
export type Slot = 'leftX' | 'leftY' | 'rightX' | 'rightY';
export type StickMode = 1 | 2 | 3 | 4;

export const SLOTS: readonly Slot[] = ['leftX', 'leftY', 'rightX', 'rightY'];
export const STICK_MODES: readonly StickMode[] = [1, 2, 3, 4];

export const SLOT_OF: Record<StickMode, Record<keyof Axes, Slot>> = {
  1: { pitch: 'leftY', yaw: 'leftX', throttle: 'rightY', roll: 'rightX' },
  2: { throttle: 'leftY', yaw: 'leftX', pitch: 'rightY', roll: 'rightX' },
  3: { pitch: 'leftY', roll: 'leftX', throttle: 'rightY', yaw: 'rightX' },
  4: { throttle: 'leftY', roll: 'leftX', pitch: 'rightY', yaw: 'rightX' },
};

/** The drone's axes for the given stick positions. */
export function axesOf(mode: StickMode, sticks: Readonly<Record<Slot, number>>): Axes {
  const at = SLOT_OF[mode];
  return { roll: sticks[at.roll], pitch: sticks[at.pitch], yaw: sticks[at.yaw], throttle: sticks[at.throttle] };
}

export function axisAt(mode: StickMode, slot: Slot): keyof Axes {
  const found = Object.entries(SLOT_OF[mode]).find(([, one]) => one === slot);
  return (found?.[0] ?? 'roll') as keyof Axes;
}
