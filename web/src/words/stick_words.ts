/** Sticks, axes and buttons in words. */

import { t } from '../languages/text';
import type { CalibrationStep } from '../link/pad_calibration';
import { axisAt, type Slot, type StickMode } from '../link/stick_modes';
import type { ButtonAction } from '../link/stick_settings';
import type { Axes } from '../link/sticks';

export const AXIS_WORDS: Record<keyof Axes, string> = {
  throttle: t('Throttle'),
  yaw: t('Yaw'),
  pitch: t('Pitch'),
  roll: t('Roll'),
};

export const SLOT_WORDS: Record<Slot, string> = {
  leftX: t('left stick, sideways'),
  leftY: t('left stick, up and down'),
  rightX: t('right stick, sideways'),
  rightY: t('right stick, up and down'),
};

const MOVES: Record<Slot, string> = {
  leftX: t('Move the left stick all the way to the right'),
  leftY: t('Move the left stick all the way up'),
  rightX: t('Move the right stick all the way to the right'),
  rightY: t('Move the right stick all the way up'),
};

/** `waits`: a stick must be released first. */
export function calibrationWords(step: CalibrationStep, waits: boolean): string {
  switch (step.name) {
    case 'rest':
      return t('Let go of both sticks, and put a throttle that stays where it is in its middle.');
    case 'find':
      return waits ? t('Good. Let go of it again.') : `${MOVES[step.slot]}.`;
    case 'range':
      return t('Move both sticks slowly round along all their edges, then press Finish.');
    case 'done':
      return t('Done.');
  }
}

export const ACTION_WORDS: Record<ButtonAction, string> = {
  none: t('Nothing'),
  hold: t('Hold: stop and stay'),
  stop: t('Stop flying by hand (holds)'),
  return: t('Return (asks)'),
  land: t('Land (asks)'),
  arm: t('Arm (asks)'),
  disarm: t('Disarm (asks)'),
  follow: t('Map follows, on or off'),
  swap: t('Swap map and video'),
};

/** Mode 2: "left: throttle, yaw; right: pitch, roll". */
export function modeWords(mode: StickMode): string {
  const at = (slot: Slot): string => axisAt(mode, slot);
  return t('left: {leftY}, {leftX}; right: {rightY}, {rightX}', {
    leftY: at('leftY'),
    leftX: at('leftX'),
    rightY: at('rightY'),
    rightX: at('rightX'),
  });
}
