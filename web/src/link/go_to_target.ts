/** Where this page has sent the drone, while that command is in force. */

import type { DroneCommand } from './drone_commands';
import type { Target } from './messages';
import { modeSetOf } from './modes';
import { isGood, type Outcome } from './outcome';
import { Store, type Readable } from './store';
import type { Telemetry } from './telemetry';

/** Commands that do not end a go-to. */
const BESIDE: ReadonlySet<DroneCommand['command']> = new Set([
  'speed',
  'yaw',
  'roi',
  'set_home',
  'servo',
  'gripper',
  'gimbal',
  'zoom',
  'photo',
  'record',
]);

export class GoToTarget {
  readonly #target = new Store<Target | null>(null);
  /** Counts commands: the answer to an older go-to says nothing about a newer command. */
  #asked = 0;

  constructor(telemetry: Telemetry) {
    telemetry.onMessage((message) => {
      // Outside guided mode the go-to is over, whatever ended it.
      if (message.name !== 'HEARTBEAT' || !telemetry.isFromAutopilot(message)) return;
      const guided = modeSetOf(message.fields.autopilot, message.fields.type)?.guided;
      if (guided && message.fields.custom_mode !== guided.customMode) this.#target.set(null);
    });
  }

  get now(): Readable<Target | null> {
    return this.#target;
  }

  /** An accepted go-to replaces the previous one. Returns what `answer` returns. */
  async follow(command: DroneCommand, answer: Promise<Outcome>): Promise<Outcome> {
    const asked = BESIDE.has(command.command) ? this.#asked : ++this.#asked;
    const outcome = await answer;
    if ((command.command === 'goto' || command.command === 'land_at') && isGood(outcome) && asked === this.#asked) {
      this.#target.set({ latDeg: command.lat, lonDeg: command.lon, altRelM: command.height_m });
    }
    return outcome;
  }

  /** Another command was given by other means. */
  forget(): void {
    this.#asked++;
  }
}
