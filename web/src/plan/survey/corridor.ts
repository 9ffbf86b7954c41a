/** Lanes along a line (a road, a power line), and a circle around a point that the camera looks at. */

import { t } from '../../languages/text';
import { CMD } from '../catalogue';
import { FRAME } from '../frames';
import { spotAt, type Point } from '../ground';
import { cleanLine } from '../outline';
import type { Spot, WireItem } from '../plan_types';
import { wireItem } from '../wire_items';
import { Drawing, heldToOneSide, SurveyFault } from './area';
import { lineCount, MAX_LINES, pictureItems, waypointAt, type Flown } from './survey_grid';

export interface CorridorSettings extends Flown {
  readonly widthM: number;
  readonly spacingM: number;
  /** Begins at the other end of the line. */
  readonly fromEnd: boolean;
}

/** At a sharp bend a lane extends at most this many times its distance. */
const MAX_MITRE = 3;

function direction(from: Point, to: Point): Point {
  const [x, y] = [to[0] - from[0], to[1] - from[1]];
  const length = Math.hypot(x, y);
  return [x / length, y / length];
}

/** The line offset to its right by this many metres; at bends lanes keep that distance from both sides. */
function beside(line: readonly Point[], metres: number): Point[] {
  return line.map((corner, at) => {
    const into = at > 0 ? direction(line[at - 1]!, corner) : null;
    const out = at + 1 < line.length ? direction(corner, line[at + 1]!) : null;
    const one = into ?? out!;
    const other = out ?? into!;
    const [x, y] = [one[0] + other[0], one[1] + other[1]];
    // Twice the cosine of half the bend: zero for a full reversal.
    const length = Math.hypot(x, y);
    const [alongX, alongY] = length < 1e-9 ? one : [x / length, y / length];
    const stretch = Math.min(MAX_MITRE, length < 1e-9 ? 1 : 2 / length);
    return [corner[0] - alongY * metres * stretch, corner[1] + alongX * metres * stretch];
  });
}

/** Lanes in the order and direction of flight. */
export function corridorLanes(line: readonly Spot[], settings: CorridorSettings): Spot[][] {
  const { widthM, spacingM, fromEnd } = settings;
  const places = cleanLine(line).corners;
  if (places.length < 2) throw new SurveyFault(t('A corridor runs along two different places at least.'));
  heldToOneSide(places, t('The corridor'));
  if (!(widthM >= 0)) throw new SurveyFault(t('The width of a corridor is 0 m or more.'));
  if (!(spacingM > 0)) throw new SurveyFault(t('The distance between lanes must be above 0.'));
  const count = lineCount(widthM, spacingM);
  if (count > MAX_LINES)
    throw new SurveyFault(t('That is {count} lanes, {maxLines} are the most.', { count, maxLines: MAX_LINES }));
  // The plane's second axis points right of its first, so that "to the right" is the same as on the ground.
  const drawing = new Drawing(places, 0);
  const points = places.map((spot) => drawing.point(spot));
  return Array.from({ length: count }, (_, lane) => {
    const spots = beside(points, (lane - (count - 1) / 2) * spacingM).map((point) => drawing.spot(point));
    return (lane % 2 === 1) !== fromEnd ? spots.toReversed() : spots;
  });
}

export function corridorItems(line: readonly Spot[], settings: CorridorSettings): WireItem[] {
  const { begin, end } = pictureItems(settings.triggerM);
  return corridorLanes(line, settings).flatMap((lane) => {
    const [first, ...rest] = lane.map((spot) => waypointAt(spot, settings));
    return [first!, ...begin, ...rest, ...end];
  });
}

export interface OrbitSettings {
  readonly radiusM: number;
  readonly heightM: number;
  readonly frame: number;
  readonly turns: number;
  /** Waypoints per turn. */
  readonly points: number;
  readonly isClockwise: boolean;
  /** Where it begins, seen from the centre, clockwise from north. */
  readonly fromDeg: number;
  /** The camera looks at the centre, at this height above the same reference; null: ahead. */
  readonly lookAtM: number | null;
  /** With the legacy command, which every release of ArduPilot knows; the newer ones came with 4.7. */
  readonly looksByLegacyRoi: boolean;
}

const LEGACY_ROI = { NOTHING: 0, POSITION: 3 } as const;

export function orbitItems(centre: Spot, settings: OrbitSettings): WireItem[] {
  const { radiusM, turns, points, isClockwise, fromDeg, lookAtM, frame, looksByLegacyRoi } = settings;
  if (!(radiusM > 0 && radiusM <= 10_000))
    throw new SurveyFault(t('The radius of a circle is more than 0 and at most 10000 m.'));
  if (!Number.isInteger(points) || points < 3 || points > 72)
    throw new SurveyFault(t('A circle has 3 to 72 waypoints.'));
  if (!Number.isInteger(turns) || turns < 1 || turns > 50) throw new SurveyFault(t('A circle is flown 1 to 50 times.'));
  const ring = Array.from({ length: points * turns + 1 }, (_, at) =>
    spotAt(centre, radiusM, fromDeg + ((isClockwise ? 360 : -360) * (at % points)) / points),
  );
  heldToOneSide([centre, ...ring], t('The circle'));
  const way = ring.map((spot) => waypointAt(spot, settings));
  if (lookAtM === null) return way;
  if (looksByLegacyRoi) {
    const at = wireItem(CMD.ROI, frame, [LEGACY_ROI.POSITION, 0, 0, 0], centre.latE7, centre.lonE7, lookAtM);
    return [at, ...way, wireItem(CMD.ROI, FRAME.GLOBAL_RELATIVE_ALT, [LEGACY_ROI.NOTHING, 0, 0, 0], 0, 0, 0)];
  }
  const look = wireItem(CMD.ROI_LOCATION, frame, [0, 0, 0, 0], centre.latE7, centre.lonE7, lookAtM);
  return [look, ...way, wireItem(CMD.ROI_NONE, FRAME.MISSION, [0, 0, 0, 0], 0, 0, 0)];
}
