/** Of a replay of two flights: the other one follows the first, on its clock and above its home. */

import { theGround } from '../terrain/the_ground';
import type { Pair } from './beside';
import type { ReplaySession } from './replay_session.svelte';

interface Replays {
  readonly session: ReplaySession | null;
  readonly other: ReplaySession | null;
  readonly pair: Pair | null;
}

const homeOf = ({ shown, player }: ReplaySession) => shown.vehicle.values(player.vehicleMs).home;

/** While the component that calls it lives. */
export function followBeside(replays: () => Replays): void {
  // The other flight is where it was as long after its take-off.
  $effect(() => {
    const { session, other, pair } = replays();
    if (!pair || !session || !other) return;
    session.player.widen(pair.fromMs, pair.toMs);
    other.player.seek(session.shown.atMs + pair.laterMs);
  });
  // One map has one home.
  $effect(() => {
    const { session, other } = replays();
    const [home, otherHome] = [session && homeOf(session), other && homeOf(other)];
    if (!other || !home || !otherHome) return;
    const [homeM, otherHomeM] = [theGround().heightM(home), theGround().heightM(otherHome)];
    other.homeUpM = typeof homeM === 'number' && typeof otherHomeM === 'number' ? otherHomeM - homeM : 0;
  });
}
