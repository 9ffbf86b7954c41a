/** Distance, time and battery: based on figures that the user enters, so no more accurate than these. */

import { t } from '../languages/text';
import { CMD } from './catalogue';
import { flownPath, type Ending, type FlownPath, type GroundAt, type Leg } from './flown_path';
import { bearingDeg, turnDeg } from './ground';
import { between } from './over_ground';
import type { Plan } from './plan_types';

export interface FlightFigures {
  readonly climbMS: number;
  readonly descentMS: number;
  /** Time of a turn by 180 degrees; other turns in proportion. */
  readonly turnBackS: number;
  /** For a circle whose item does not specify one. */
  readonly circleRadiusM: number;
  /** Battery per cent per minute, as seen in other flights; null: unknown. */
  readonly batteryPerMin: number | null;
  /** Width of the strip that one line of pictures adds; null: no camera. */
  readonly stripM: number | null;
}

export const USUAL_FIGURES: FlightFigures = {
  climbMS: 2.5,
  descentMS: 1.5,
  turnBackS: 4,
  circleRadiusM: 10,
  batteryPerMin: null,
  stripM: null,
};

export interface Estimate {
  readonly lengthM: number;
  readonly seconds: number;
  readonly batteryPercent: number | null;
  /** Above home. */
  readonly highestM: number;
  readonly pictures: number;
  readonly coveredM2: number | null;
  readonly ending: Ending;
  /** What the figures leave out, in words. */
  readonly notes: readonly string[];
}

/** Smaller turns are numerical noise. */
const STRAIGHT_DEG = 1;
const SHORT_M = 0.1;

export function turnsS(legs: readonly Leg[], turnBackS: number): Map<number, number> {
  const costs = new Map<number, number>();
  let before: number | null = null;
  for (const [at, leg] of legs.entries()) {
    if (leg.lengthM < SHORT_M) continue;
    const heading = bearingDeg(leg.from, leg.to);
    const turn = before === null ? 0 : turnDeg(before, heading);
    if (turn > STRAIGHT_DEG) costs.set(at, (turn / 180) * turnBackS);
    before = heading;
  }
  return costs;
}

export function legS(leg: Leg, speedMS: number, figures: FlightFigures): number {
  const climb = leg.toHeightM - leg.fromHeightM;
  const vertical = climb >= 0 ? climb / figures.climbMS : -climb / figures.descentMS;
  // A copter climbs while it flies: the slower of the two determines the time.
  return Math.max(leg.lengthM / speedMS, vertical);
}

export function estimate(plan: Plan, figures: FlightFigures, path: FlownPath = flownPath(plan)): Estimate {
  const { legs, order } = path;
  const turns = turnsS(legs, figures.turnBackS);
  const notes = new Set<string>();
  let [lengthM, seconds, pictures, photographedM] = [0, 0, 0, 0];
  let speedMS = plan.defaults.speedMS;
  let everyM = 0;
  let at = 0;
  for (const seq of order.steps) {
    const item = plan.items[seq]!;
    const [p1, p2, p3] = item.params;
    for (; at < legs.length && legs[at]!.seq === seq; at += 1) {
      const leg = legs[at]!;
      lengthM += leg.lengthM;
      seconds += legS(leg, speedMS, figures) + (turns.get(at) ?? 0);
      if (everyM > 0) {
        photographedM += leg.lengthM;
        pictures += Math.floor(leg.lengthM / everyM) + (leg.lengthM > 0 ? 1 : 0);
      }
    }
    switch (item.command) {
      case CMD.CHANGE_SPEED:
        if ((p1 === 0 || p1 === 1) && p2 !== null && p2 > 0) speedMS = p2;
        else if ((p1 === 0 || p1 === 1) && p2 === -2) speedMS = plan.defaults.speedMS;
        break;
      case CMD.WAYPOINT:
      case CMD.SPLINE_WAYPOINT:
      case CMD.LOITER_TIME:
        seconds += Math.max(0, p1 ?? 0);
        break;
      case CMD.LOITER_TURNS: {
        const radius = Math.abs(p3 ?? 0) || figures.circleRadiusM;
        const round = 2 * Math.PI * radius * Math.max(0, p1 ?? 0);
        lengthM += round;
        seconds += round / speedMS;
        break;
      }
      case CMD.NAV_DELAY:
        if ((p1 ?? 0) >= 0) seconds += p1 ?? 0;
        else notes.add(t('Item {seq} waits for a time of day: that wait is not in the time.', { seq: seq + 1 }));
        break;
      case CMD.TRIGGER_DISTANCE:
        everyM = Math.max(0, p1 ?? 0);
        break;
      case CMD.CAMERA_SHOT:
        pictures += 1;
        break;
    }
  }
  if (order.ending === 'for-ever')
    notes.add(t('The mission goes round for ever: the figures are for the first time round.'));
  if (order.ending === 'waits')
    notes.add(t('The mission ends waiting for a command: the way home is not in the figures.'));
  if (order.ending === 'too-long') notes.add(t('The mission jumps too often to be followed to its end.'));
  if (!plan.home) notes.add(t('There is no home: the ways from it and back to it are not in the figures.'));
  return {
    lengthM,
    seconds,
    batteryPercent: figures.batteryPerMin === null ? null : (seconds / 60) * figures.batteryPerMin,
    highestM: legs.reduce((most, leg) => Math.max(most, leg.toHeightM), 0),
    pictures,
    coveredM2: figures.stripM === null ? null : photographedM * figures.stripM,
    ending: order.ending,
    notes: [...notes],
  };
}

export interface ProfilePoint {
  /** Distance along the path. */
  readonly alongM: number;
  readonly heightM: number;
  /** The item that it flies to. */
  readonly seq: number;
  /** The ground under it, above home's; null: not known. */
  readonly groundM: number | null;
}

/** About as many samples as a drawing needs; includes each corner, so that no peak is lost. */
export function heightProfile(path: FlownPath, samples = 200, groundOverHome?: GroundAt): ProfilePoint[] {
  const groundM = (leg: Leg, part: number): number | null => groundOverHome?.(between(leg.from, leg.to, part)) ?? null;
  const total = path.legs.reduce((sum, leg) => sum + leg.lengthM, 0);
  const points: ProfilePoint[] = [];
  let alongM = 0;
  for (const leg of path.legs) {
    if (points.length === 0) points.push({ alongM, heightM: leg.fromHeightM, seq: leg.seq, groundM: groundM(leg, 0) });
    const steps = total > 0 ? Math.max(1, Math.round((leg.lengthM / total) * samples)) : 1;
    for (let step = 1; step <= steps; step += 1) {
      const part = step / steps;
      const heightM = leg.fromHeightM + (leg.toHeightM - leg.fromHeightM) * part;
      points.push({ alongM: alongM + leg.lengthM * part, heightM, seq: leg.seq, groundM: groundM(leg, part) });
    }
    alongM += leg.lengthM;
  }
  return points;
}
