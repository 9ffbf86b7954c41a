/**
 * Flies the mission on board: start, pause, resume, jump, return. Each question names the drone and says what it will
 * do.
 */

import { confirmArming, warningsBefore } from '../../arming';
import { ask, LEAVES_OR_ENDS_S } from '../../confirmation.svelte';
import { t } from '../../languages/text';
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
    const what = t('flies the mission on board ({items} items)', { items });
    if (armed === true) {
      const text = airborne
        ? t('{name} is in the air. It {what}, from the first item on, at once.', { name, what })
        : t('{name} has its motors running. It {what}: it takes off. Is everybody clear of it?', { name, what });
      const title = t('Start the mission of {name}?', { name });
      const warnings = airborne ? [] : await warningsBefore(this.#vehicle);
      const isHeld = airborne ? {} : { heldS: LEAVES_OR_ENDS_S, warnings };
      if (!(await ask({ title, text, confirmLabel: t('Start'), ...isHeld }))) return null;
      return this.#begun(() => this.#perform(t('Start the mission'), { command: 'start' }));
    }
    const text = t('The motors of {name} will start to turn. It {what}: it takes off. Is everybody clear of it?', {
      name,
      what,
    });
    const acknowledge = await confirmArming(this.#vehicle, {
      title: t('Arm {name} and start its mission?', { name }),
      text,
      confirmLabel: t('Arm and start'),
    });
    if (!acknowledge) return null;
    // The tower arms the drone as one of the steps.
    return this.#begun(() => this.#perform(t('Arm and start the mission'), { command: 'start' }, acknowledge));
  }

  async #begun(action: () => Promise<CommandReport>): Promise<CommandReport> {
    const reported = await action();
    if (reported.isGood) this.#vehicle.mission.begun();
    return reported;
  }

  /** Never asks: it is urgent when an obstacle is ahead. */
  pause(): Promise<CommandReport> {
    return this.#perform(t('Pause'), { command: 'pause' });
  }

  async resume(item: number | null): Promise<CommandReport | null> {
    const where = item === null ? t('where it was interrupted') : t('with item {item}', { item: item + 1 });
    const text = t('{name} flies on with its mission, {where}, at once.', { name: this.#name, where });
    if (!(await ask({ title: t('{name}: fly on?', { name: this.#name }), text, confirmLabel: t('Resume') })))
      return null;
    return this.#perform(t('Resume'), { command: 'resume' });
  }

  async jump(item: number, label: string): Promise<CommandReport | null> {
    const text = t('{name} goes on with item {item} ({label}) of its mission and skips what is between.', {
      name: this.#name,
      item: item + 1,
      label,
    });
    const question = {
      title: t('{name}: fly on from item {item}?', { name: this.#name, item: item + 1 }),
      text,
      confirmLabel: t('Fly on from there'),
    };
    if (!(await ask(question))) return null;
    return this.#perform(t('Jump to item {item}', { item: item + 1 }), { command: 'jump', item });
  }

  async returnHome(): Promise<CommandReport | null> {
    const text = t('{name} leaves its mission, flies back to its home and lands there.', { name: this.#name });
    const question = { title: t('Return {name}?', { name: this.#name }), text, confirmLabel: t('Return') };
    if (!(await ask({ ...question, heldS: LEAVES_OR_ENDS_S }))) return null;
    return this.#perform(t('Return'), { command: 'rtl' });
  }

  async #perform(label: string, command: DroneCommand, before?: () => Promise<void>): Promise<CommandReport> {
    const outcome = await this.#vehicle.command(label, command, before);
    return { isGood: isGood(outcome), words: `${label}: ${outcomeWords(this.#name, outcome)}` };
  }
}
