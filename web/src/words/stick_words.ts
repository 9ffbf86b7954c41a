/** Sticks, axes and buttons in words. */

import { t } from '../languages/text';
import type { NoStick, PadCalibration } from '../link/pad_calibration';
import type { Unready } from '../link/pad_source';
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

export function calibrationWords({ step, waitsForRest, unfinished }: PadCalibration): string {
  switch (step.name) {
    case 'rest':
      return t('Let go of both sticks, and put a throttle that stays where it is in its middle.');
    case 'find':
      return waitsForRest
        ? t('Good. Let go of it again, and put a throttle back in its middle.')
        : `${MOVES[step.slot]}.`;
    case 'range':
      return unfinished.length > 0
        ? t('Move both sticks slowly round along all their edges. Still to see: {sticks}.', {
            sticks: unfinished.map((slot) => SLOT_WORDS[slot]).join('; '),
          })
        : t('Both sticks were at all their edges. Press Finish.');
    case 'back':
      return t('Let go of both sticks, and put the throttle back in its middle.');
    case 'done':
      return t('Done.');
  }
}

/** What an axis is that is no stick. */
export const NO_STICK_WORDS: Record<NoStick, string> = {
  end: t('rests at an end'),
  jumps: t('jumps'),
  stays: t('does not come back'),
  restless: t('never rests'),
};

export function complaintWords({ axis, why }: { readonly axis: number; readonly why: NoStick }): string {
  switch (why) {
    case 'end':
      return t(
        'Axis {axis} rests at an end, as a trigger or a switch does. If it is your throttle, put it in its middle and begin again.',
        { axis },
      );
    case 'jumps':
      return t('Axis {axis} jumps, as a switch does. If it is your stick, move it more slowly.', { axis });
    case 'stays':
      return t(
        'Axis {axis} did not come back, as a trigger or a switch does not. If it is your throttle, put it back in its middle and move it again.',
        { axis },
      );
    case 'restless':
      return t('Axis {axis} was never at rest. If it is your stick, let go of it and begin again.', { axis });
  }
}

export const UNREADY_WORDS: Record<Unready, string> = {
  'unknown-layout': t(
    'This browser does not know the axes of this device: one of them may be a trigger. Set it up before you fly with it.',
  ),
  'other-layout': t(
    'This device was set up in another browser or an older console, perhaps with other axes. Set it up again before you fly with it.',
  ),
  'shared-axis': t('Two sticks are set to the same axis. Set the device up before you fly with it.'),
  'no-stick': t('A stick is set to an axis that is a trigger or a hat. Set the device up before you fly with it.'),
};

export const unmovedWords = (slots: readonly Slot[]): string =>
  t('Move both sticks once to their ends and let go of them. Still to see: {sticks}.', {
    sticks: slots.map((slot) => SLOT_WORDS[slot]).join('; '),
  });

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
