/** The drones' parameters as the tower has them: read once, and again when their hash changes. */

import type { Operation } from './operation_types';
import type { Operations } from './operations';
import { RestError, type Rest } from './rest';
import type { Schemas } from './rest_types';

export type ParameterRow = Schemas['ParameterView'];
export type ParametersRead = Schemas['ParametersView'];

const PARAMETERS = '/drones/{drone_id}/parameters';
const NOT_MODIFIED = 304;
const NOT_FOUND = 404;

export class ParameterTables {
  readonly #rest: Rest;
  readonly #operations: Operations;
  readonly #kept = new Map<number, ParametersRead>();

  constructor(rest: Rest, operations: Operations) {
    this.#rest = rest;
    this.#operations = operations;
  }

  /** As last read; null: not yet. */
  kept(droneId: number): ParametersRead | null {
    return this.#kept.get(droneId) ?? null;
  }

  /** The tower's current parameters: the same object if nothing has changed. Raises RestError `parameters-unknown`. */
  async read(droneId: number): Promise<ParametersRead> {
    const before = this.kept(droneId);
    const header = before ? { 'if-none-match': `"${before.hash}"` } : {};
    try {
      const now = await this.#rest.call('GET', PARAMETERS, { path: { drone_id: droneId }, header });
      this.#kept.set(droneId, now);
      return now;
    } catch (error) {
      if (before && error instanceof RestError && error.status === NOT_MODIFIED) return before;
      throw error;
    }
  }

  /** The vehicle's own parameter metadata, unprocessed; null: none. The browser caches it by its ETag. */
  async metadata(droneId: number): Promise<unknown> {
    try {
      return await this.#rest.call('GET', `${PARAMETERS}/metadata`, { path: { drone_id: droneId } });
    } catch (error) {
      if (error instanceof RestError && error.status === NOT_FOUND) return null;
      throw error;
    }
  }

  /** From the autopilot itself. */
  readAgain(droneId: number): Promise<Operation> {
    return this.#operations.start('POST', `${PARAMETERS}/read`, { path: { drone_id: droneId } });
  }

  write(droneId: number, values: Readonly<Record<string, number>>): Promise<Operation> {
    return this.#operations.start('PATCH', PARAMETERS, { path: { drone_id: droneId }, body: { values } });
  }

  /** Another user signs in. */
  clear(): void {
    this.#kept.clear();
  }
}
