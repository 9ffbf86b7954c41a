/**
 * The parameters of one drone on display: the table, the facts about each, pending changes, and changes by others
 * meanwhile.
 */

import { t } from './languages/text';
import type { Operation } from './link/operation_types';
import { RestError } from './link/rest';
import type { ParametersRead } from './link/parameter_tables';
import type { Vehicle } from './link/vehicle';
import { wordsOf } from './loading.svelte';
import { factsOfComponent, withVehicle } from './parameters/component_facts';
import { changes, EMPTY_TRAY, put, takenOut, type Change, type Tray } from './parameters/tray';
import { NO_FACTS, type Facts } from './parameters/facts';
import { isSame, tableOf, type Table } from './parameters/kinds';
import { loadFacts, type Autopilot } from './parameters/load_facts';
import { tower } from './tower.svelte';

const NOT_READ = 'parameters-unknown';

export class ParameterBook {
  read = $state.raw<ParametersRead | null>(null);
  tray = $state.raw<Tray>(EMPTY_TRAY);
  /** The last operation that this page began: reading or writing. */
  operation = $state.raw<Operation | null>(null);
  /** Changes since the page opened, except by its own writing: name and previous value. */
  changedElsewhere = $state.raw<ReadonlyMap<string, number>>(new Map());
  problem = $state('');
  #ours = $state.raw<Facts>(NO_FACTS);
  #vehicles = $state.raw<Facts | null>(null);
  /** The facts about the parameters: ours, overlaid with the vehicle's own. */
  readonly facts: Facts = $derived(this.#vehicles ? withVehicle(this.#ours, this.#vehicles) : this.#ours);
  readonly isFromVehicle: boolean = $derived(this.#vehicles !== null);
  readonly table: Table = $derived(tableOf(this.read?.values ?? []));
  readonly changes: readonly Change[] = $derived(changes(this.tray, this.table));
  readonly isBusy: boolean = $derived(this.operation?.state === 'running');
  readonly #vehicle: Vehicle;
  /** Values that this page has asked to write: their arrival is no news. */
  #asked = new Map<string, number>();

  constructor(vehicle: Vehicle) {
    this.#vehicle = vehicle;
    this.read = tower.parameterTables.kept(this.#droneId);
  }

  get #droneId(): number {
    return this.#vehicle.drone.get().id;
  }

  async know(autopilot: Autopilot): Promise<void> {
    try {
      this.#ours = await loadFacts(autopilot);
    } catch {
      this.problem = t(
        'The descriptions of the parameters could not be loaded from the tower. You can still change parameters.',
      );
    }
  }

  /** The vehicle's own facts. If they are missing or invalid, ours remain. */
  async askVehicle(): Promise<void> {
    try {
      const reported = await tower.parameterTables.metadata(this.#droneId);
      this.#vehicles = reported === null ? null : factsOfComponent(reported);
    } catch {
      // No caller waits for it.
    }
  }

  /** Reads the tower's current values. */
  async refresh(): Promise<void> {
    try {
      const before = this.table;
      const read = await tower.parameterTables.read(this.#droneId);
      if (read === this.read) return;
      this.read = read;
      this.#noteChanges(before);
      this.problem = '';
    } catch (error) {
      const isBeingRead = error instanceof RestError && error.slug === NOT_READ;
      this.problem = isBeingRead ? '' : wordsOf(error);
    }
  }

  #noteChanges(before: Table): void {
    if (before.size === 0) return;
    const reported = new Map(this.changedElsewhere);
    for (const { name, value, kind } of this.table.values()) {
      const old = before.get(name);
      if (!old || isSame(old.value, value, kind)) continue;
      const asked = this.#asked.get(name);
      if (asked !== undefined && isSame(asked, value, kind)) reported.delete(name);
      else reported.set(name, reported.get(name) ?? old.value);
    }
    this.changedElsewhere = reported;
  }

  seen(): void {
    this.changedElsewhere = new Map();
  }

  put(name: string, value: number): void {
    this.tray = put(this.tray, this.table, name, value);
  }

  takeOut(name: string): void {
    this.tray = takenOut(this.tray, name);
  }

  empty(): void {
    this.tray = EMPTY_TRAY;
  }

  /** The ended operation, or null: it did not begin, and `problem` says why. */
  async write(): Promise<Operation | null> {
    const values = Object.fromEntries(this.changes.map(({ name, after }) => [name, after]));
    this.#asked = new Map(Object.entries(values));
    return this.#follow(() => tower.parameterTables.write(this.#droneId, values));
  }

  async readAgain(): Promise<void> {
    await this.#follow(() => tower.parameterTables.readAgain(this.#droneId));
  }

  async #follow(begin: () => Promise<Operation>): Promise<Operation | null> {
    if (this.isBusy) return null;
    this.problem = '';
    try {
      const begun = await begin();
      const stop = tower.operations.all.subscribe((all) => (this.operation = all.get(begun.id) ?? this.operation));
      const ended = await tower.operations.ended(begun.id);
      stop();
      this.operation = ended;
      await this.refresh();
      return ended;
    } catch (error) {
      this.problem = wordsOf(error);
      return null;
    }
  }
}
