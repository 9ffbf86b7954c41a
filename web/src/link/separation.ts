/**
 * Drones that come near each other, as the tower reports (docs/separation.md): lines for the map. The other drone may be
 * hidden from this user: then only its rough position is known, not its identity. Alerts of them: link/alerts.ts.
 */

import { t } from '../languages/text';
import { offsetBy } from './geometry';
import type { Place } from './messages';
import { Store } from './store';
import type { SeparationEvent } from './wire_types';

export type LengthWords = (metres: number) => string;
const METRES: LengthWords = (metres) => `${Math.round(metres)} m`;

/** After a new connection the tower reports at once what holds; anything not reported by then is over. */
const REPORTED_WITHIN_MS = 4_000;

/** A line on the map, from one drone to the other. */
export interface NearLine {
  readonly from: Place;
  readonly to: Place;
  readonly isWarning: boolean;
  /** Their distance now. */
  readonly label: string;
  /** The line ends at a drone that this user may not see. */
  readonly isStranger: boolean;
}

export class Separations {
  /** Current encounters by number. */
  readonly near = new Store<ReadonlyMap<number, SeparationEvent>>(new Map());
  #unreported = new Set<number>();
  #unreportedSinceMs = 0;

  take(event: SeparationEvent): void {
    const { number, level } = event;
    this.#unreported.delete(number);
    if (level === 'clear') {
      this.#over(number);
      return;
    }
    this.near.update((all) => new Map(all).set(number, event));
  }

  /** A new connection: encounters that the tower does not report again are over. */
  connected(nowMs: number): void {
    this.#unreported = new Set(this.near.get().keys());
    this.#unreportedSinceMs = nowMs;
  }

  look(nowMs: number): void {
    if (this.#unreported.size === 0 || nowMs - this.#unreportedSinceMs < REPORTED_WITHIN_MS) return;
    for (const number of this.#unreported) this.#over(number);
    this.#unreported.clear();
  }

  /** The user may no longer see the drone. */
  gone(droneId: number): void {
    for (const [number, { drones }] of this.near.get()) if (drones.includes(droneId)) this.#over(number);
  }

  clear(): void {
    this.near.set(new Map());
    this.#unreported.clear();
  }

  #over(number: number): void {
    this.#unreported.delete(number);
    if (!this.near.get().has(number)) return;
    const left = new Map(this.near.get());
    left.delete(number);
    this.near.set(left);
  }
}

/** `placeOf`: the current position of one of our drones, null if unknown. `onlyOf`: only the lines of this drone. */
export function nearLines(
  near: Iterable<SeparationEvent>,
  placeOf: (droneId: number) => Place | null,
  length: LengthWords = METRES,
  onlyOf: number | null = null,
): NearLine[] {
  const lines: NearLine[] = [];
  for (const event of near) {
    const [own, other] = event.drones;
    if (onlyOf !== null && own !== onlyOf && other !== onlyOf) continue;
    const { bearing_deg: bearing, distance_m: away, above_m: above } = event;
    const from = placeOf(own);
    if (!from || bearing === null || away === null || above === null) continue;
    const angle = (bearing * Math.PI) / 180;
    const to = (other !== null && placeOf(other)) || offsetBy(from, away * Math.cos(angle), away * Math.sin(angle));
    const about = other === null ? `${t('about')} ` : '';
    const label = t('{about}{length}, {length2} in height', {
      about,
      length: length(away),
      length2: length(Math.abs(above)),
    });
    lines.push({ from, to, isWarning: event.level === 'warning', label, isStranger: other === null });
  }
  return lines;
}
