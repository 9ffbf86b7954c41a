/**
 * A drone's progress through its mission on board, from MISSION_CURRENT and MISSION_ITEM_REACHED. Items count from 0 as
 * in a plan: some autopilots keep home as their own item 0.
 */

import type { Message } from './mavlink';
import { profileOf } from './modes';
import { Store } from './store';

const MISSION_MODES: ReadonlySet<string> = new Set(['AUTO', 'MISSION']);
/** Whether a drone flies its mission, paused or not, judged by its mode's name. */
export const isMissionFlown = ({ armed, mode }: { armed: boolean | null; mode: string | null }): boolean =>
  armed === true && MISSION_MODES.has(mode ?? '');

export interface Progress {
  /** The item that it flies to or carries out; null: none, or not reported. */
  readonly current: number | null;
  readonly reached: ReadonlySet<number>;
}

/** MISSION_STATE. */
const ACTIVE = 3;

const NONE: Progress = { current: null, reached: new Set() };

export class MissionProgress {
  readonly now = new Store<Progress>(NONE);
  #hash: string | null | undefined = undefined;
  /** The drone accepted a pause; until something resumes the mission. For autopilots that do not report it. */
  wasPaused = false;

  /** The plan on board changed: no item of the new mission has been reached yet. */
  onBoard(hash: string | null): void {
    if (this.#hash !== undefined && hash !== this.#hash) {
      this.now.set(NONE);
      this.wasPaused = false;
    }
    this.#hash = hash;
  }

  /** A new start of the mission: no item has been reached. */
  begun(): void {
    this.wasPaused = false;
    this.now.update(({ current }) => ({ current, reached: new Set() }));
  }

  /** `autopilot` as in its heartbeat; null before the first. */
  receive(message: Message, autopilot: number | null): void {
    if (message.name !== 'MISSION_CURRENT' && message.name !== 'MISSION_ITEM_REACHED') return;
    if (autopilot === null) return;
    if (message.name === 'MISSION_CURRENT' && message.fields.mission_state === ACTIVE) this.wasPaused = false;
    const item = message.fields.seq - (profileOf(autopilot, null)?.hasHomeSlot ? 1 : 0);
    const { current, reached } = this.now.get();
    if (message.name === 'MISSION_CURRENT') {
      const next = item < 0 ? null : item;
      if (next !== current) this.now.set({ current: next, reached });
    } else if (item >= 0 && !reached.has(item)) {
      this.now.set({ current, reached: new Set(reached).add(item) });
    }
  }
}
