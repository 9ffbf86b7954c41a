/** Where this page has sent the drone, while that holds. */

import type { DroneCommand } from './drone_commands';
import type { Target } from './messages';
import { modeSetOf } from './modes';
import { isGood, type Outcome } from './outcome';
import { Store, type Readable } from './store';
import type { Telemetry } from './telemetry';

/** They leave it on its way. */
const BESIDE: ReadonlySet<DroneCommand['command']> = new Set(['speed', 'yaw', 'roi', 'set_home']);

export class GoToTarget {
  readonly #target = new Store<Target | null>(null);
  /** Counts what was asked for: the answer to an older go-to says nothing about a newer command. */
  #asked = 0;

  constructor(telemetry: Telemetry) {
    telemetry.onMessage((message) => {
      // Out of guided mode the go-to is over, whoever ended it.
      if (message.name !== 'HEARTBEAT' || !telemetry.isFromAutopilot(message)) return;
      const guided = modeSetOf(message.fields.autopilot)?.guided;
      if (guided && message.fields.custom_mode !== guided.customMode) this.#target.set(null);
    });
  }

  get now(): Readable<Target | null> {
    return this.#target;
  }

  /** Takes the place of a go-to that is accepted. Answers as `answer` does. */
  async follow(command: DroneCommand, answer: Promise<Outcome>): Promise<Outcome> {
    const asked = BESIDE.has(command.command) ? this.#asked : ++this.#asked;
    const outcome = await answer;
    if (command.command === 'goto' && isGood(outcome) && asked === this.#asked) {
      this.#target.set({ latDeg: command.lat, lonDeg: command.lon, altRelM: command.height_m });
    }
    return outcome;
  }

  /** Something else was asked for, by another way. */
  forget(): void {
    this.#asked++;
  }
}
