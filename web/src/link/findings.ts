/** What controllers on board have found, by drone: read once, then kept current by the live channel. */

import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import { Store, type Readable } from './store';

export type Finding = Schemas['FindingView'];

export interface FindingEvent {
  readonly type: 'finding';
  readonly drone_id: number;
  readonly finding: Finding;
}

/** As many as the tower keeps. */
export const MAX_FINDINGS = 20;

const isSame = (one: Finding, other: Finding): boolean => one.number === other.number && one.at === other.at;

/** Both lists as one, newest first. A finding that is in both is there once. */
export function newestFirst(list: readonly Finding[], more: readonly Finding[]): Finding[] {
  const added = more.filter((one) => !list.some((known) => isSame(known, one)));
  return [...added, ...list].sort((a, b) => Date.parse(b.at) - Date.parse(a.at)).slice(0, MAX_FINDINGS);
}

export class Findings {
  readonly #rest: Pick<Rest, 'call'>;
  readonly #all = new Store<ReadonlyMap<number, readonly Finding[]>>(new Map());

  constructor(rest: Pick<Rest, 'call'>) {
    this.#rest = rest;
  }

  /** Newest first, by the drone's id. */
  get all(): Readable<ReadonlyMap<number, readonly Finding[]>> {
    return this.#all;
  }

  take({ drone_id, finding }: FindingEvent): void {
    this.#add(drone_id, [finding]);
  }

  /** Events may have been missed. Raises RestError. */
  async read(droneId: number): Promise<void> {
    const path = { drone_id: droneId };
    this.#add(droneId, await this.#rest.call('GET', '/drones/{drone_id}/controller/findings', { path }));
  }

  /** What one user saw is not shown to the next. */
  forget(): void {
    this.#all.set(new Map());
  }

  #add(droneId: number, more: readonly Finding[]): void {
    this.#all.update((all) => new Map(all).set(droneId, newestFirst(all.get(droneId) ?? [], more)));
  }
}
