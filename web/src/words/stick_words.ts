/** Sticks, axes and buttons in words. */

import type { CalibrationStep } from '../link/pad_calibration';
import { axisAt, type Slot, type StickMode } from '../link/stick_modes';
import type { ButtonAction } from '../link/stick_settings';
import type { Axes } from '../link/sticks';

export const AXIS_WORDS: Record<keyof Axes, string> = {
  throttle: 'Throttle',
  yaw: 'Yaw',
  pitch: 'Pitch',
  roll: 'Roll',
};

export const SLOT_WORDS: Record<Slot, string> = {
  leftX: 'left stick, sideways',
  leftY: 'left stick, up and down',
  rightX: 'right stick, sideways',
  rightY: 'right stick, up and down',
};

const MOVES: Record<Slot, string> = {
  leftX: 'Move the left stick all the way to the right',
  leftY: 'Move the left stick all the way up',
  rightX: 'Move the right stick all the way to the right',
  rightY: 'Move the right stick all the way up',
};

/** `waits`: a stick must be released first. */
export function calibrationWords(step: CalibrationStep, waits: boolean): string {
  switch (step.name) {
    case 'rest':
      return 'Let go of both sticks, and put a throttle that stays where it is in its middle.';
    case 'find':
      return waits ? 'Good. Let go of it again.' : `${MOVES[step.slot]}.`;
    case 'range':
      return 'Move both sticks slowly round along all their edges, then press Finish.';
    case 'done':
      return 'Done.';
  }
}

export const ACTION_WORDS: Record<ButtonAction, string> = {
  none: 'Nothing',
  hold: 'Hold: stop and stay',
  stop: 'Stop flying by hand (holds)',
  return: 'Return (asks)',
  land: 'Land (asks)',
  arm: 'Arm (asks)',
  disarm: 'Disarm (asks)',
  follow: 'Map follows, on or off',
  swap: 'Swap map and video',
};

/** Mode 2: "left: throttle, yaw; right: pitch, roll". */
export function modeWords(mode: StickMode): string {
  const at = (slot: Slot): string => axisAt(mode, slot);
  return `left: ${at('leftY')}, ${at('leftX')}; right: ${at('rightY')}, ${at('rightX')}`;
}
