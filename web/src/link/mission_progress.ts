/**
 * How far a drone is with the mission on board, as its autopilot tells (MISSION_CURRENT, MISSION_ITEM_REACHED). Items are
 * numbered as in a plan, from 0: some autopilots keep home in their own number 0.
 */

import type { Message } from './mavlink';
import { profileOf } from './modes';
import { Store } from './store';

const MISSION_MODES: ReadonlySet<string> = new Set(['AUTO', 'MISSION']);
/** Whether a drone flies its mission, paused or not, by its mode's name. */
export const isMissionFlown = ({ armed, mode }: { armed: boolean | null; mode: string | null }): boolean =>
  armed === true && MISSION_MODES.has(mode ?? '');

export interface Progress {
  /** The item that it flies to or carries out; null: none, or not said. */
  readonly current: number | null;
  readonly reached: ReadonlySet<number>;
}

const NONE: Progress = { current: null, reached: new Set() };

export class MissionProgress {
  readonly now = new Store<Progress>(NONE);
  #hash: string | null | undefined = undefined;

  /** What is on board: of another mission nothing was reached yet. */
  onBoard(hash: string | null): void {
    if (this.#hash !== undefined && hash !== this.#hash) this.now.set(NONE);
    this.#hash = hash;
  }

  /** Another beginning. */
  begun(): void {
    this.now.update(({ current }) => ({ current, reached: new Set() }));
  }

  /** `autopilot` as its heartbeat says; null before there was one. */
  receive(message: Message, autopilot: number | null): void {
    if (message.name !== 'MISSION_CURRENT' && message.name !== 'MISSION_ITEM_REACHED') return;
    if (autopilot === null) return;
    const item = message.fields.seq - (profileOf(autopilot)?.hasHomeSlot ? 1 : 0);
    const { current, reached } = this.now.get();
    if (message.name === 'MISSION_CURRENT') {
      const next = item < 0 ? null : item;
      if (next !== current) this.now.set({ current: next, reached });
    } else if (item >= 0 && !reached.has(item)) {
      this.now.set({ current, reached: new Set(reached).add(item) });
    }
  }
}
