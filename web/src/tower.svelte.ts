/** The one connection of this page to the tower, and the beat at which numbers on screen are renewed. */

import { Tower } from './link/tower';

/** People cannot read digits that change faster. The map has its own, quicker beat. */
const READ_BEAT_MS = 200;
/** How often the tower sends the newest state of drones that are not focused. */
export const WATCH_RATE_HZ = 5;

export const tower = new Tower();
tower.live.watch(WATCH_RATE_HZ);
window.addEventListener('online', () => tower.live.retryNow());

const LOOK_MS = 1_000;
setInterval(() => tower.look(), LOOK_MS);

export const beat = $state({ nowMs: tower.clock.nowMs() });
setInterval(() => {
  beat.nowMs = tower.clock.nowMs();
}, READ_BEAT_MS);
