/**
 * The keys of the Control page, in the order of its help sheet. W A S D and the arrow keys are reserved for the sticks.
 */

import { t } from './languages/text';

export type ShortcutName =
  | 'controls'
  | 'arm'
  | 'disarm'
  | 'takeoff'
  | 'hold'
  | 'return'
  | 'land'
  | 'goto'
  | 'mode'
  | 'height'
  | 'speed'
  | 'heading'
  | 'home'
  | 'manual'
  | 'sticks'
  | 'follow'
  | 'swap'
  | 'messages'
  | 'switch'
  | 'help';

export interface Shortcut {
  /** As in KeyboardEvent.key. */
  readonly key: string;
  readonly name: ShortcutName;
  readonly words: string;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { key: 'c', name: 'controls', words: t('Take or release control') },
  { key: 'h', name: 'hold', words: t('Hold: stop and stay here, at once') },
  { key: 'r', name: 'return', words: t('Return (asks)') },
  { key: 'l', name: 'land', words: t('Land (asks)') },
  { key: 'i', name: 'arm', words: t('Arm (asks)') },
  { key: 'I', name: 'disarm', words: t('Disarm (asks; in flight twice)') },
  { key: 't', name: 'takeoff', words: t('To the take-off height; Enter takes off (asks)') },
  { key: 'g', name: 'goto', words: t('To the map: arrows move it, Enter opens the menu of its middle') },
  { key: 'm', name: 'mode', words: t('To the flight mode') },
  { key: 'e', name: 'height', words: t('To the height in flight; Enter changes it') },
  { key: 'p', name: 'speed', words: t('To the speed in flight') },
  { key: 'n', name: 'heading', words: t('To the heading') },
  { key: 'o', name: 'home', words: t('Set home where the drone is (asks)') },
  { key: 'b', name: 'manual', words: t('Fly by hand, or stop it') },
  { key: 'k', name: 'sticks', words: t('Set up the sticks') },
  { key: 'f', name: 'follow', words: t('Map follows the drone, on or off') },
  { key: 'v', name: 'swap', words: t('Swap map and video') },
  { key: 'j', name: 'messages', words: t('To the messages') },
  { key: 'x', name: 'switch', words: t('Change the drone') },
  { key: '?', name: 'help', words: t('This sheet') },
];

/** The shortcut of a key press; null with a modifier (Shift is part of the key). */
export function shortcutOf(
  event: Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey' | 'repeat'>,
): ShortcutName | null {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return null;
  return SHORTCUTS.find(({ key }) => key === event.key)?.name ?? null;
}
