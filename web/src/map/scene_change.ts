/** Whether a scene differs visibly from the previous one: an unchanged scene is not redrawn. Pure. */

import type { Place } from '../link/messages';
import type { NearLine } from '../link/separation';
import type { MapTarget } from './ground_signs';
import type { Scene, SceneDrone } from './overlay';

const samePlace = (a: Place | null, b: Place | null): boolean =>
  a === b || (a !== null && b !== null && a.latDeg === b.latDeg && a.lonDeg === b.lonDeg);

/** Points are only appended at one end and dropped at the other. */
const sameTrack = (a: readonly Place[], b: readonly Place[]): boolean =>
  a === b || (a.length === b.length && a[0] === b[0] && a.at(-1) === b.at(-1));

const sameDrone = (a: SceneDrone, b: SceneDrone): boolean =>
  a === b ||
  (a.id === b.id &&
    a.name === b.name &&
    a.detail === b.detail &&
    samePlace(a.place, b.place) &&
    a.upM === b.upM &&
    a.headingDeg === b.headingDeg &&
    a.state === b.state &&
    a.isUnattended === b.isUnattended &&
    a.isStale === b.isStale &&
    a.alarm === b.alarm &&
    a.passed === b.passed &&
    sameTrack(a.track, b.track));

const sameTarget = (a: MapTarget | null, b: MapTarget | null): boolean =>
  a === b ||
  (a !== null && b !== null && a.label === b.label && samePlace(a.place, b.place) && samePlace(a.from, b.from));

const sameLine = (a: NearLine, b: NearLine): boolean =>
  a.isWarning === b.isWarning && a.label === b.label && samePlace(a.from, b.from) && samePlace(a.to, b.to);

const NONE: readonly NearLine[] = [];
const sameLines = (a: readonly NearLine[], b: readonly NearLine[]): boolean =>
  a === b || (a.length === b.length && a.every((line, index) => sameLine(line, b[index]!)));

export function sameScene(a: Scene, b: Scene): boolean {
  return (
    a.selectedId === b.selectedId &&
    a.showsAim === b.showsAim &&
    a.distanceWords === b.distanceWords &&
    samePlace(a.home, b.home) &&
    sameTarget(a.target, b.target) &&
    sameTarget(a.proposed ?? null, b.proposed ?? null) &&
    sameLines(a.near ?? NONE, b.near ?? NONE) &&
    a.drones.length === b.drones.length &&
    a.drones.every((drone, index) => sameDrone(drone, b.drones[index]!))
  );
}
