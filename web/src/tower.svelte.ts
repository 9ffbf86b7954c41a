/** This page's one connection to the tower, and the tick at which displayed numbers are updated. */

import { realClock } from './link/clock';
import { steadyClock, type TickWorker } from './link/steady_clock';
import { Tower } from './link/tower';

/** People cannot read digits that change faster. The map has its own, faster tick. */
const READ_BEAT_MS = 200;
/** How often the tower sends the newest state of drones that are not focused. */
export const WATCH_RATE_HZ = 5;

const openTickWorker = (): TickWorker =>
  new Worker(new URL('./link/steady_clock_worker.ts', import.meta.url), { type: 'module' }) as TickWorker;

export const tower = new Tower({ beatClock: steadyClock(realClock, openTickWorker) });
tower.live.watch(WATCH_RATE_HZ);
window.addEventListener('online', () => tower.live.retryNow());

const LOOK_MS = 1_000;
setInterval(() => tower.look(), LOOK_MS);

export const beat = $state({ nowMs: tower.clock.nowMs() });
setInterval(() => {
  beat.nowMs = tower.clock.nowMs();
}, READ_BEAT_MS);
