/** Turns reports of the tower and the drones into alerts. Callers feed it everything; it requests nothing. */

import { Alerts } from './alerts';
import { conditionsOf, SILENCE, type Condition } from './conditions';
import { causeWords, holdWords, orderReason } from './event_words';
import type { Entry } from './journal';
import { Separations } from './separation';
import type { Vehicle } from './vehicle';
import type { HoldEvent } from './wire_types';

export class AlertFeed {
  readonly alerts = new Alerts();
  readonly separations = new Separations(this.alerts);
  /** Statements arrive in chunks: maps the key of a journal entry to the key of its alert. */
  readonly #keyOf = new Map<string, string>();
  readonly #silent = new Set<number>();
  /** Alert of the last ordered hold, by drone. */
  readonly #orderedHold = new Map<number, string>();

  /** Called about once a second: updates the alerts of the current conditions. */
  look(vehicles: Iterable<Vehicle>, nowMs: number): void {
    for (const vehicle of vehicles) {
      const drone = vehicle.drone.get();
      const conditions = conditionsOf(drone, vehicle.values(nowMs), vehicle.wasAirborne);
      this.alerts.holds(drone.id, this.#believed(drone.id, conditions), nowMs);
    }
    this.separations.look(nowMs);
  }

  /**
   * A page that was suspended (a laptop that slept, a busy browser) runs this before it has read the pending messages:
   * silence counts only when it is found twice.
   */
  #believed(droneId: number, conditions: readonly Condition[]): readonly Condition[] {
    const isSilent = conditions.some(({ id }) => id === SILENCE);
    const wasSilent = this.#silent.has(droneId);
    if (isSilent) this.#silent.add(droneId);
    else this.#silent.delete(droneId);
    return isSilent && !wasSilent ? conditions.filter(({ id }) => id !== SILENCE) : conditions;
  }

  /** The user may no longer see the drone: its conditions end. */
  gone(droneId: number, nowMs: number): void {
    this.alerts.holds(droneId, [], nowMs);
    this.separations.gone(droneId);
  }

  /** A journal entry. Warnings and worse from the autopilot become alerts. */
  entry(entry: Entry): void {
    if (entry.source !== 'autopilot' || entry.severity === 'info') return;
    const severity = entry.severity === 'error' ? 'critical' : 'warning';
    const known = this.#keyOf.get(entry.key);
    if (known !== undefined) {
      this.alerts.reworded(known, entry.text);
      return;
    }
    this.#keyOf.clear(); // only the newest can still grow
    this.#keyOf.set(entry.key, this.alerts.said(entry.droneId, severity, entry.text, entry.atMs));
  }

  hold(event: HoldEvent, nowMs: number): void {
    if (event.step === 'unconfirmed') {
      this.alerts.said(event.drone_id, 'critical', holdWords(event), nowMs);
    } else if (event.step === 'ordered') {
      const text = `Put on hold: ${causeWords(event.cause ?? 'order', orderReason(event))}.`;
      this.#orderedHold.set(event.drone_id, this.alerts.said(event.drone_id, 'warning', text, nowMs));
    } else if (event.step === 'not_needed') {
      const key = this.#orderedHold.get(event.drone_id);
      if (key !== undefined) this.alerts.reworded(key, `No hold was needed${event.detail ? `: ${event.detail}` : ''}.`);
    }
  }

  clear(): void {
    this.#keyOf.clear();
    this.#orderedHold.clear();
    this.#silent.clear();
    this.separations.clear();
    this.alerts.clear();
  }
}
