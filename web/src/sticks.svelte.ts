/** The pilot's input devices on this page: the settings of their sticks, and the connected pads. */

import { usablePads, type PadLike } from './link/pad_source';
import { StickSettingsStore } from './link/stick_settings_store';
import { SticksSeen } from './link/sticks_seen';
import { tower } from './tower.svelte';

export const pads = (): readonly (PadLike | null)[] => navigator.getGamepads();
export const pluggedIn = (): PadLike[] => usablePads(pads);

export const sticks = new StickSettingsStore(tower.clock, tower.rest);
let whose: number | null = null;
tower.user.subscribe((user) => {
  // Called with each welcome; for the same user it asks again only if the tower has not answered yet.
  const isAnother = user?.id !== whose;
  whose = user?.id ?? null;
  if (!user) sticks.forget();
  else if (isAnother || !sticks.kept.get().isRead) void sticks.read();
});

/** Outlives the page of a drone: who flew the last one has moved the sticks. */
export const sticksSeen = new SticksSeen();
// It may be back before the next reading.
addEventListener('gamepaddisconnected', () => sticksSeen.forget());
