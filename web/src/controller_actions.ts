/** Starts and stops controllers on board. Asks before the start, and names the drone (as pilot_actions.ts). */

import { ask } from './confirmation.svelte';
import { t } from './languages/text';
import type { ControllerStart } from './link/controllers';
import type { Operation } from './link/operation_types';
import type { Operations } from './link/operations';
import type { Drone } from './link/wire_types';
import { startWords } from './words/controller_words';
import type { UnitSystem } from './words/units';

type Begins = Pick<Operations, 'start' | 'cancel'>;

export class ControllerActions {
  readonly #operations: Begins;

  constructor(operations: Begins) {
    this.#operations = operations;
  }

  /** Resolves to null if the person does not confirm. Raises RestError if the tower refuses. */
  async start(drone: Drone, start: ControllerStart, system: UnitSystem): Promise<Operation | null> {
    const consent = await ask({
      title: t('Let {controller} fly {name}?', { controller: start.controller, name: drone.name }),
      text: startWords(drone.name, start, system),
      confirmLabel: t('Start'),
      isDanger: true,
    });
    if (!consent) return null;
    return this.#operations.start('POST', '/drones/{drone_id}/controller', {
      path: { drone_id: drone.id },
      body: start,
    });
  }

  /** Does not ask: the drone holds. Raises RestError. */
  async stop({ id }: Operation): Promise<void> {
    await this.#operations.cancel(id);
  }
}
