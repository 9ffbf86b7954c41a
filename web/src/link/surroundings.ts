/** What is around the drones: zones, other aircraft, and what controllers on board have found. */

import { realClock } from './clock';
import { Findings } from './findings';
import type { Rest } from './rest';
import { Sightings } from './sightings';
import { Store, type Readable } from './store';
import type { Aircraft, TowerEvent, User } from './wire_types';
import { Zones } from './zones';

export class Surroundings {
  readonly zones: Zones;
  readonly findings: Findings;
  readonly sightings = new Sightings(realClock);
  readonly #aircraft = new Store<readonly Aircraft[]>([]);

  /** Forgets everything when `user` signs out. */
  constructor(rest: Pick<Rest, 'call'>, user: Readable<User | null>) {
    this.zones = new Zones(rest);
    this.findings = new Findings(rest);
    user.subscribe((present) => {
      if (present) return;
      this.zones.forget();
      this.findings.forget();
      this.sightings.forget();
      this.#aircraft.set([]);
    });
  }

  /** As of the last second. */
  get aircraft(): Readable<readonly Aircraft[]> {
    return this.#aircraft;
  }

  /** Every event of the tower. */
  take(event: TowerEvent): void {
    if (event.type === 'aircraft') this.#aircraft.set(event.aircraft);
    else if (event.type === 'finding') this.findings.take(event);
    else if (event.type === 'zones' || event.type === 'welcome') void this.zones.read();
    if (event.type === 'finding' || event.type === 'sighting') this.sightings.take(event);
  }
}
