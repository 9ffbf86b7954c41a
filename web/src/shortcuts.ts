/**
 * The keys of the Control page, in the order of its help sheet. W A S D and the arrow keys are reserved for the sticks.
 */

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
  | 'help';

export interface Shortcut {
  /** As in KeyboardEvent.key. */
  readonly key: string;
  readonly name: ShortcutName;
  readonly words: string;
}

export const SHORTCUTS: readonly Shortcut[] = [
  { key: 'c', name: 'controls', words: 'Take up or release the controls' },
  { key: 'h', name: 'hold', words: 'Hold: stop and stay here, at once' },
  { key: 'r', name: 'return', words: 'Return (asks)' },
  { key: 'l', name: 'land', words: 'Land (asks)' },
  { key: 'i', name: 'arm', words: 'Arm (asks)' },
  { key: 'I', name: 'disarm', words: 'Disarm (asks; in flight twice)' },
  { key: 't', name: 'takeoff', words: 'To the take-off height; Enter takes off (asks)' },
  { key: 'g', name: 'goto', words: 'Go to a place: arrows move the map, Enter picks its middle' },
  { key: 'm', name: 'mode', words: 'To the flight mode' },
  { key: 'e', name: 'height', words: 'To the height in flight; Enter changes it (asks)' },
  { key: 'p', name: 'speed', words: 'To the speed in flight' },
  { key: 'n', name: 'heading', words: 'To the heading' },
  { key: 'o', name: 'home', words: 'Set home where the drone is (asks)' },
  { key: 'b', name: 'manual', words: 'Fly by hand, or stop it' },
  { key: 'k', name: 'sticks', words: 'Set up the sticks' },
  { key: 'f', name: 'follow', words: 'Map follows the drone, on or off' },
  { key: 'v', name: 'swap', words: 'Swap map and video' },
  { key: 'j', name: 'messages', words: 'To the messages' },
  { key: '?', name: 'help', words: 'This sheet' },
];

/** The shortcut of a key press; null with a modifier (Shift is part of the key). */
export function shortcutOf(
  event: Pick<KeyboardEvent, 'key' | 'ctrlKey' | 'metaKey' | 'altKey' | 'repeat'>,
): ShortcutName | null {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return null;
  return SHORTCUTS.find(({ key }) => key === event.key)?.name ?? null;
}
