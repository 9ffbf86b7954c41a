/** The drones that this user may see, one `Vehicle` each, from REST answers and live events. */

import { t } from '../languages/text';
import type { Alerts } from './alerts';
import type { AssistTurns } from './assist_turns';
import type { Clock } from './clock';
import { mayCommand } from './drone_view';
import type { LostControlsLog } from './lost_controls';
import type { Separations } from './separation';
import { Store, type Readable } from './store';
import type { Vehicle } from './vehicle';
import type { Drone, LinkQuality, User } from './wire_types';

const CONTROLS_GONE = t('we no longer have the controls');

export interface SquadOptions {
  readonly clock: Clock;
  readonly user: Readable<User | null>;
  readonly lostControls: LostControlsLog;
  readonly assist: AssistTurns;
  readonly alerts: Alerts;
  readonly separations: Separations;
  readonly newVehicle: (drone: Drone) => Vehicle;
}

export class Squad {
  readonly vehicles = new Store<ReadonlyMap<number, Vehicle>>(new Map());
  /** Our clock minus the tower's time of day, measured when the connection began. */
  towerLagMs = 0;
  readonly #options: SquadOptions;

  constructor(options: SquadOptions) {
    this.#options = options;
  }

  setTowerTime(said: string): void {
    const saidMs = Date.parse(said);
    if (Number.isFinite(saidMs)) this.towerLagMs = this.#options.clock.nowMs() - saidMs;
  }

  drones(): Drone[] {
    return [...this.vehicles.get().values()].map((vehicle) => vehicle.drone.get());
  }

  put(drone: Drone): void {
    const known = this.vehicles.get().get(drone.id);
    // REST answers and live events may arrive out of order: an older epoch is outdated.
    if (known && drone.epoch < known.drone.get().epoch) return;
    this.#set([...this.drones().filter(({ id }) => id !== drone.id), drone]);
  }

  links(qualities: readonly LinkQuality[]): void {
    for (const quality of qualities) {
      const vehicle = this.vehicles.get().get(quality.drone_id);
      if (vehicle) vehicle.link = quality;
    }
  }

  remove(droneId: number): void {
    this.#dropped(droneId);
    this.#set(this.drones().filter(({ id }) => id !== droneId));
  }

  /** Replaces the whole squad. */
  replace(drones: readonly Drone[]): void {
    const kept = new Set(drones.map(({ id }) => id));
    for (const { id } of this.drones()) if (!kept.has(id)) this.#dropped(id);
    this.#set(drones);
  }

  #dropped(droneId: number): void {
    const vehicle = this.vehicles.get().get(droneId);
    if (!vehicle) return;
    const { lostControls, user, alerts, separations, clock } = this.#options;
    lostControls.removed(vehicle.drone.get(), user.get(), clock.nowMs());
    vehicle.manual.stop(CONTROLS_GONE, { holds: false });
    vehicle.abort(t('it is no longer in our squad'));
    alerts.gone(droneId);
    separations.gone(droneId);
  }

  #set(drones: readonly Drone[]): void {
    const { clock, user, lostControls, assist, newVehicle } = this.#options;
    const before = this.vehicles.get();
    const me = user.get();
    const nowMs = clock.nowMs();
    const next = new Map<number, Vehicle>();
    for (const drone of [...drones].sort((a, b) => a.id - b.id)) {
      const known = before.get(drone.id);
      const vehicle = known ?? newVehicle(drone);
      if (vehicle.drone.get() !== drone || !known) {
        lostControls.drone(known?.drone.get() ?? null, drone, me, nowMs);
        assist.drone(drone);
        vehicle.put(drone, nowMs, this.towerLagMs);
      }
      if (me && !mayCommand(drone, me)) vehicle.manual.stop(CONTROLS_GONE, { holds: false });
      next.set(drone.id, vehicle);
    }
    this.vehicles.set(next);
  }
}
