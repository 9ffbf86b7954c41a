/** Flying the mission that is on board: start, pause, resume, jump, return. Each question names the drone and says what it will do. */

import { agreeToArm } from '../../arming';
import { ask } from '../../confirmation.svelte';
import { commandDrone, type DroneCommand } from '../../link/drone_commands';
import type { FlightValues } from '../../link/flight_values';
import type { Operation } from '../../link/operation_types';
import type { Vehicle } from '../../link/vehicle';
import { wordsOf } from '../../loading.svelte';
import { tower } from '../../tower.svelte';

export interface Told {
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

  /** Null: the pilot thought better of it. `items`: of the mission on board. */
  async start(items: number): Promise<Told | null> {
    const name = this.#name;
    const { airborne, armed } = this.#values();
    const what = `flies the mission that is on board (${items} items)`;
    if (armed === true) {
      const text = airborne
        ? `${name} is in the air. It ${what}, from the first item on, at once.`
        : `${name} has its motors running. It ${what}: it takes off. Is everybody clear of it?`;
      if (!(await ask({ title: `Start the mission of ${name}?`, text, confirmLabel: 'Start' }))) return null;
      return this.#begun(() => this.#tell('Start the mission', { command: 'start' }));
    }
    const text = `The motors of ${name} will start to turn. It ${what}: it takes off. Is everybody clear of it?`;
    const acknowledge = await agreeToArm(this.#vehicle, {
      title: `Arm ${name} and start its mission?`,
      text,
      confirmLabel: 'Arm and start',
    });
    if (!acknowledge) return null;
    return this.#begun(async () => {
      try {
        await acknowledge();
      } catch (error) {
        return { isGood: false, words: wordsOf(error) };
      }
      // The tower arms it as one of the steps.
      return this.#tell('Arm and start the mission', { command: 'start' });
    });
  }

  async #begun(action: () => Promise<Told>): Promise<Told> {
    const told = await action();
    if (told.isGood) this.#vehicle.mission.begun();
    return told;
  }

  /** Never asks: it is what one does when something is in the way. */
  pause(): Promise<Told> {
    return this.#tell('Pause', { command: 'pause' });
  }

  async resume(item: number | null): Promise<Told | null> {
    const where = item === null ? 'where it was interrupted' : `with item ${item + 1}`;
    const text = `${this.#name} flies on with its mission, ${where}, at once.`;
    if (!(await ask({ title: `${this.#name}: fly on?`, text, confirmLabel: 'Resume' }))) return null;
    return this.#tell('Resume', { command: 'resume' });
  }

  async jump(item: number, label: string): Promise<Told | null> {
    const text = `${this.#name} goes on with item ${item + 1} (${label}) of its mission; what lies between is left out.`;
    const question = { title: `${this.#name}: fly on from item ${item + 1}?`, text, confirmLabel: 'Fly on from there' };
    if (!(await ask(question))) return null;
    return this.#tell(`Jump to item ${item + 1}`, { command: 'jump', item });
  }

  async returnHome(): Promise<Told | null> {
    const text = `${this.#name} leaves its mission, flies back to its home and lands there.`;
    if (!(await ask({ title: `Return ${this.#name}?`, text, confirmLabel: 'Return' }))) return null;
    return this.#tell('Return', { command: 'rtl' });
  }

  async #tell(label: string, command: DroneCommand): Promise<Told> {
    const { id, name } = this.#vehicle.drone.get();
    let told: Told;
    try {
      told = toldOf(label, name, await commandDrone(tower.operations, id, command));
    } catch (error) {
      told = { isGood: false, words: `${label}: ${wordsOf(error)}` };
    }
    tower.record({ droneId: id, source: 'command', severity: told.isGood ? 'info' : 'error', text: told.words });
    return told;
  }
}

function toldOf(label: string, name: string, { state, words, code }: Operation): Told {
  const isGood = state === 'done';
  const said = words || (isGood ? `${name} accepted it` : `${name} did not do it${code ? ` (${code})` : ''}`);
  return { isGood, words: `${label}: ${said}` };
}
