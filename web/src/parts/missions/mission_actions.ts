/**
 * Flies the mission on board: start, pause, resume, jump, return. Each question names the drone and says what it will
 * do.
 */

import { confirmArming } from '../../arming';
import { ask } from '../../confirmation.svelte';
import type { DroneCommand } from '../../link/drone_commands';
import type { FlightValues } from '../../link/flight_values';
import { isGood, outcomeWords } from '../../link/outcome';
import type { Vehicle } from '../../link/vehicle';

export interface CommandReport {
  readonly isGood: boolean;
  readonly words: string;
}

export class MissionActions {
  readonly #vehicle: Vehicle;
  readonly #values: () => FlightValues;

  constructor(vehicle: Vehicle, values: () => FlightValues) {
    this.#vehicle = vehicle;
    this.#values = values;
  }

  get #name(): string {
    return this.#vehicle.drone.get().name;
  }

  /** Null: the pilot cancelled. `items`: number of items of the mission on board. */
  async start(items: number): Promise<CommandReport | null> {
    const name = this.#name;
    const { airborne, armed } = this.#values();
    const what = `flies the mission on board (${items} items)`;
    if (armed === true) {
      const text = airborne
        ? `${name} is in the air. It ${what}, from the first item on, at once.`
        : `${name} has its motors running. It ${what}: it takes off. Is everybody clear of it?`;
      if (!(await ask({ title: `Start the mission of ${name}?`, text, confirmLabel: 'Start' }))) return null;
      return this.#begun(() => this.#perform('Start the mission', { command: 'start' }));
    }
    const text = `The motors of ${name} will start to turn. It ${what}: it takes off. Is everybody clear of it?`;
    const acknowledge = await confirmArming(this.#vehicle, {
      title: `Arm ${name} and start its mission?`,
      text,
      confirmLabel: 'Arm and start',
    });
    if (!acknowledge) return null;
    // The tower arms the drone as one of the steps.
    return this.#begun(() => this.#perform('Arm and start the mission', { command: 'start' }, acknowledge));
  }

  async #begun(action: () => Promise<CommandReport>): Promise<CommandReport> {
    const reported = await action();
    if (reported.isGood) this.#vehicle.mission.begun();
    return reported;
  }

  /** Never asks: it is urgent when an obstacle is ahead. */
  pause(): Promise<CommandReport> {
    return this.#perform('Pause', { command: 'pause' });
  }

  async resume(item: number | null): Promise<CommandReport | null> {
    const where = item === null ? 'where it was interrupted' : `with item ${item + 1}`;
    const text = `${this.#name} flies on with its mission, ${where}, at once.`;
    if (!(await ask({ title: `${this.#name}: fly on?`, text, confirmLabel: 'Resume' }))) return null;
    return this.#perform('Resume', { command: 'resume' });
  }

  async jump(item: number, label: string): Promise<CommandReport | null> {
    const text = `${this.#name} goes on with item ${item + 1} (${label}) of its mission and skips what is between.`;
    const question = { title: `${this.#name}: fly on from item ${item + 1}?`, text, confirmLabel: 'Fly on from there' };
    if (!(await ask(question))) return null;
    return this.#perform(`Jump to item ${item + 1}`, { command: 'jump', item });
  }

  async returnHome(): Promise<CommandReport | null> {
    const text = `${this.#name} leaves its mission, flies back to its home and lands there.`;
    if (!(await ask({ title: `Return ${this.#name}?`, text, confirmLabel: 'Return' }))) return null;
    return this.#perform('Return', { command: 'rtl' });
  }

  async #perform(label: string, command: DroneCommand, before?: () => Promise<void>): Promise<CommandReport> {
    const outcome = await this.#vehicle.command(label, command, before);
    return { isGood: isGood(outcome), words: `${label}: ${outcomeWords(this.#name, outcome)}` };
  }
}
