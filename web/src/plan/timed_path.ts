/** A drone's position over time on a plan: the flown path with the estimated times. */

import { CMD } from './catalogue';
import { legS, turnsS, type FlightFigures } from './estimates';
import { flownPath, type Ending, type FlownPath } from './flown_path';
import type { Plan, Spot } from './plan_types';

/** A straight piece of the path at one speed, or a stay. Seconds since the start; metres above home. */
export interface TimedPiece {
  readonly fromS: number;
  readonly toS: number;
  readonly from: Spot;
  readonly to: Spot;
  readonly fromHeightM: number;
  readonly toHeightM: number;
  /** The item that it flies to, or carries out. */
  readonly seq: number;
  /** For circles: the distance from `from` meanwhile. */
  readonly reachM: number;
}

export interface TimedPath {
  readonly pieces: readonly TimedPiece[];
  readonly seconds: number;
  readonly ending: Ending;
  /** Whether it is in the air at the end of the plan: then it stays there. */
  readonly staysUp: boolean;
}

/** Below this it is on the ground. */
const GROUND_M = 0.3;

/** Its `seconds` equal those of `estimate` for the same plan and figures. */
export function timedPath(plan: Plan, figures: FlightFigures, path: FlownPath = flownPath(plan)): TimedPath {
  const { legs, order } = path;
  const turns = turnsS(legs, figures.turnBackS);
  const pieces: TimedPiece[] = [];
  let nowS = 0;
  let speedMS = plan.defaults.speedMS;
  let at = 0;
  let here: { spot: Spot; heightM: number } | null = legs[0]
    ? { spot: legs[0].from, heightM: legs[0].fromHeightM }
    : null;

  const stay = (seconds: number, seq: number, reachM = 0): void => {
    if (!(seconds > 0)) return;
    if (here) {
      const { spot, heightM } = here;
      const height = { fromHeightM: heightM, toHeightM: heightM };
      pieces.push({ fromS: nowS, toS: nowS + seconds, from: spot, to: spot, ...height, seq, reachM });
    }
    nowS += seconds;
  };

  for (const seq of order.steps) {
    const item = plan.items[seq]!;
    const [p1, p2, p3] = item.params;
    for (; at < legs.length && legs[at]!.seq === seq; at += 1) {
      const { from, to, fromHeightM, toHeightM } = legs[at]!;
      stay(turns.get(at) ?? 0, seq);
      const seconds = legS(legs[at]!, speedMS, figures);
      pieces.push({ fromS: nowS, toS: nowS + seconds, from, to, fromHeightM, toHeightM, seq, reachM: 0 });
      nowS += seconds;
      here = { spot: to, heightM: toHeightM };
    }
    switch (item.command) {
      case CMD.CHANGE_SPEED:
        if ((p1 === 0 || p1 === 1) && p2 !== null && p2 > 0) speedMS = p2;
        else if ((p1 === 0 || p1 === 1) && p2 === -2) speedMS = plan.defaults.speedMS;
        break;
      case CMD.WAYPOINT:
      case CMD.SPLINE_WAYPOINT:
      case CMD.LOITER_TIME:
        stay(p1 ?? 0, seq);
        break;
      case CMD.LOITER_TURNS: {
        const radius = Math.abs(p3 ?? 0) || figures.circleRadiusM;
        stay((2 * Math.PI * radius * Math.max(0, p1 ?? 0)) / speedMS, seq, radius);
        break;
      }
      case CMD.NAV_DELAY:
        stay(p1 ?? 0, seq);
        break;
    }
  }
  const staysUp = here !== null && here.heightM > GROUND_M;
  return { pieces, seconds: nowS, ending: order.ending, staysUp };
}
