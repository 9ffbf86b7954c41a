/** The zones that this user may see (docs/zones.md), read anew whenever the tower says that they have changed. */

import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import { Store, type Readable } from './store';

export type Zone = Schemas['ZoneView'];
export type ZoneBody = Schemas['ZoneBody'];
export type ZoneKind = Zone['kind'];
export type ZoneShapes = Schemas['ShapesView'];

export class Zones {
  readonly #list = new Store<readonly Zone[]>([]);
  readonly #rest: Pick<Rest, 'call'>;
  #readings = 0;

  constructor(rest: Pick<Rest, 'call'>) {
    this.#rest = rest;
  }

  get list(): Readable<readonly Zone[]> {
    return this.#list;
  }

  /** The last zones stay if the tower does not answer. */
  async read(): Promise<void> {
    const reading = ++this.#readings;
    try {
      const zones = await this.#rest.call('GET', '/zones');
      if (reading === this.#readings) this.#list.set(zones);
    } catch {
      return; // an older tower, or none: the next connection asks again
    }
  }

  forget(): void {
    this.#readings += 1;
    this.#list.set([]);
  }

  create(body: ZoneBody): Promise<Zone> {
    return this.#rest.call('POST', '/zones', { body });
  }

  replace({ id, version }: Zone, body: ZoneBody): Promise<Zone> {
    return this.#rest.call('PUT', '/zones/{zone_id}', { path: { zone_id: id }, body: { ...body, version } });
  }

  async remove({ id }: Zone): Promise<void> {
    await this.#rest.call('DELETE', '/zones/{zone_id}', { path: { zone_id: id } });
  }

  /** The shapes of a GeoJSON or KML file. */
  shapesOf(text: string): Promise<ZoneShapes> {
    return this.#rest.call('POST', '/zones/shapes', { body: { text } });
  }
}
