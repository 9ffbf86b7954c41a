/**
 * Drones that come near each other, as the tower reports (docs/separation.md): one alert each, and lines for the map.
 * The other drone may be hidden from this user: then only its rough position is known, not its identity.
 */

import type { Alerts } from './alerts';
import { offsetBy } from './geometry';
import type { Place } from './messages';
import { Store } from './store';
import type { SeparationEvent } from './wire_types';

export type LengthWords = (metres: number) => string;
const METRES: LengthWords = (metres) => `${Math.round(metres)} m`;

/** After a new connection the tower reports at once what holds; anything not reported by then is over. */
const REPORTED_WITHIN_MS = 4_000;
const SOON_S = 1;

const DIRECTIONS = ['north', 'north-east', 'east', 'south-east', 'south', 'south-west', 'west', 'north-west'] as const;

export const directionWords = (bearingDeg: number): string =>
  DIRECTIONS[Math.round((((bearingDeg % 360) + 360) % 360) / 45) % DIRECTIONS.length]!;

/** One or two sentences, with the names that this user may see. */
export function separationWords(
  event: SeparationEvent,
  nameOf: (droneId: number) => string,
  length: LengthWords = METRES,
): string {
  const [own, other] = event.drones;
  const { in_s: inS, horizontal_m: horizontalM, vertical_m: verticalM } = event;
  if (other === null) return strangerWords(event, nameOf(own), length);
  const both = `${nameOf(own)} and ${nameOf(other)}`;
  const apart =
    horizontalM === null || verticalM === null
      ? ''
      : ` ${length(horizontalM)} apart, ${length(verticalM)} in height${inS !== null && inS > SOON_S ? `, in ${Math.round(inS)} s` : ''}`;
  const what = inS !== null && inS > SOON_S ? 'will be' : 'are';
  return apart ? `${both} ${what}${apart}.` : `${both} are too near each other.`;
}

/** The tower rounds the figures of a drone that this user may not see. */
function strangerWords(event: SeparationEvent, ownName: string, length: LengthWords): string {
  const { in_s: inS, bearing_deg: bearing, distance_m: away, above_m: above } = event;
  const both = `${ownName} and another drone`;
  const when =
    inS !== null && inS > SOON_S
      ? `${both} will be close in about ${Math.round(inS)} s.`
      : `${both} are near each other.`;
  if (bearing === null || away === null || above === null) return when;
  const height =
    above === 0 ? 'at about the same height' : `about ${length(Math.abs(above))} ${above > 0 ? 'higher' : 'lower'}`;
  const degrees = String(Math.round(bearing)).padStart(3, '0');
  return `${when} Seen from ${ownName} it is about ${length(away)} to the ${directionWords(bearing)} (${degrees}°), ${height}.`;
}

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
  length: LengthWords = METRES;
  readonly #alerts: Alerts;
  readonly #worst = new Map<number, 'caution' | 'warning'>();
  #unreported = new Set<number>();
  #unreportedSinceMs = 0;

  constructor(alerts: Alerts) {
    this.#alerts = alerts;
  }

  take(event: SeparationEvent, nameOf: (droneId: number) => string, nowMs: number): void {
    const { number, level } = event;
    this.#unreported.delete(number);
    if (level === 'clear') {
      this.#over(number);
      return;
    }
    this.near.update((all) => new Map(all).set(number, event));
    const worst = this.#worst.get(number);
    if (worst === level || worst === 'warning') return;
    // A warning stays a warning until it is over: another alert on the way back would add nothing.
    if (worst) this.#alerts.over(nameFor(number, worst));
    this.#worst.set(number, level);
    const words = separationWords(event, nameOf, this.length);
    this.#alerts.lasts(
      nameFor(number, level),
      event.drones[0],
      level === 'warning' ? 'critical' : 'warning',
      words,
      nowMs,
    );
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
    this.#worst.clear();
    this.#unreported.clear();
  }

  #over(number: number): void {
    const worst = this.#worst.get(number);
    if (worst) this.#alerts.over(nameFor(number, worst));
    this.#worst.delete(number);
    this.#unreported.delete(number);
    if (!this.near.get().has(number)) return;
    const left = new Map(this.near.get());
    left.delete(number);
    this.near.set(left);
  }
}

const nameFor = (number: number, level: 'caution' | 'warning'): string => `separation/${number}/${level}`;

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
    const about = other === null ? 'about ' : '';
    const label = `${about}${length(away)}, ${length(Math.abs(above))} in height`;
    lines.push({ from, to, isWarning: event.level === 'warning', label, isStranger: other === null });
  }
  return lines;
}
