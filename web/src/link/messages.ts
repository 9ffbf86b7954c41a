/** Text messages of the console on the live connection, as pure builders, and the console's MAVLink identity. */

/** The console on the MAVLink network: a ground station, as autopilots expect it. */
export const CONSOLE = { sysid: 255, compid: 190 } as const;
export const AUTOPILOT_COMPID = 1;

export const watchText = (rateHz: number): string => JSON.stringify({ type: 'watch', rate_hz: rateHz });
export const pongText = (sequence: number): string => JSON.stringify({ type: 'pong', sequence });
export const focusText = (droneId: number | null): string => JSON.stringify({ type: 'focus', drone_id: droneId });

/** The area of a map, in degrees. Longitudes may run beyond 180 either way on a map that wraps around. */
export interface MapBounds {
  readonly south: number;
  readonly west: number;
  readonly north: number;
  readonly east: number;
}

/** Share of the map's width and height on each side: a drone about to come into view is already up to date. */
const VIEWPORT_MARGIN = 0.2;

/** Tells the tower which drones it may send less often; null: none. */
export function viewportText(shown: MapBounds | null): string {
  return JSON.stringify({ type: 'viewport', bounds: shown && widened(shown) });
}

function widened({ south, west, north, east }: MapBounds): MapBounds {
  const up = (north - south) * VIEWPORT_MARGIN;
  const aside = (east - west) * VIEWPORT_MARGIN;
  const lat = (deg: number): number => Math.max(-90, Math.min(90, deg));
  const isWholeTurn = east - west + 2 * aside >= 360;
  return {
    south: lat(south - up),
    west: isWholeTurn ? -180 : wrapped(west - aside),
    north: lat(north + up),
    east: isWholeTurn ? 180 : wrapped(east + aside),
  };
}

/** A longitude of a map that wraps around, as -180 to 180. */
export const wrapped = (lonDeg: number): number => ((((lonDeg + 180) % 360) + 360) % 360) - 180;

export interface Place {
  readonly latDeg: number;
  readonly lonDeg: number;
}

export interface Target extends Place {
  /** Above home. */
  readonly altRelM: number;
}
