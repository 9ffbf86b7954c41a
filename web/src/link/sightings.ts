/** The targets that controllers on board have in view, by drone: where the live video shows them, for a few seconds. */

import type { Clock } from './clock';
import type { FindingEvent } from './findings';
import type { Schemas } from './rest_types';
import { Store, type Readable } from './store';

export type VideoBox = Schemas['InVideoView'];

export interface SightingEvent {
  readonly type: 'sighting';
  readonly drone_id: number;
  readonly letter: string;
  readonly confidence: number;
  readonly in_video: VideoBox;
}

export interface Sighting {
  /** Empty: not read. */
  readonly letter: string;
  readonly confidence: number;
  readonly box: VideoBox;
  /** When the picture was taken, by the clock's monotonic time, as well as is known here. */
  readonly takenMs: number;
}

export class Sightings {
  readonly #clock: Pick<Clock, 'monotonicMs'>;
  readonly #newest = new Store<ReadonlyMap<number, Sighting>>(new Map());

  constructor(clock: Pick<Clock, 'monotonicMs'>) {
    this.#clock = clock;
  }

  /** By the drone's id. They stay until the next one: whoever shows them looks at their age. */
  get newest(): Readable<ReadonlyMap<number, Sighting>> {
    return this.#newest;
  }

  take(event: SightingEvent | FindingEvent): void {
    const { letter, confidence, in_video: box } = event.type === 'sighting' ? event : event.finding;
    // An older tower's finding has none.
    if (!box) return;
    const takenMs = this.#clock.monotonicMs() - box.age_s * 1000;
    this.#newest.update((all) => new Map(all).set(event.drone_id, { letter, confidence, box, takenMs }));
  }

  forget(): void {
    this.#newest.set(new Map());
  }
}
