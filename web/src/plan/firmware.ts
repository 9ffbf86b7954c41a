/** What the release of a drone's autopilot lacks in missions (wire/autopilots/ardupilot_plans.py). */

export interface Firmware {
  /** For people: `4.6.2`; empty: not known. */
  readonly words: string;
  /** Mission commands that it refuses. */
  readonly lacks: ReadonlySet<number>;
}

export const ANY_FIRMWARE: Firmware = { words: '', lacks: new Set() };

type Release = readonly [number, number];
/** Mission commands, and the release that brought each (`missionSince` of link/modes). */
export type MissionSince = Readonly<Record<string, Release>>;

interface OfDrone {
  readonly firmware?: string | null;
  readonly release?: readonly number[] | null;
}

const isBefore = (release: readonly number[], [major, minor]: Release): boolean =>
  release[0]! < major || (release[0] === major && release[1]! < minor);

/** Nothing is lacking where the release is not known: the drone's refusal says so. */
export function firmwareOf(drone: OfDrone | null | undefined, since: MissionSince): Firmware {
  const { firmware, release } = drone ?? {};
  if (!release) return ANY_FIRMWARE;
  const lacks = Object.keys(since).filter((command) => isBefore(release, since[command]!));
  return { words: firmware ?? '', lacks: new Set(lacks.map(Number)) };
}
