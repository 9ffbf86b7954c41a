/**
 * The current page, from the hash of the address. `#/` is the monitor, `#/drone/7` the control page of drone 7,
 * `#/drone/7/parameters`, `#/drone/7/setup/radio` and `#/drone/7/logs` its others, `#/missions` the planner, `#/missions/7` the planner for
 * drone 7, `#/squad-mission/1,2` a task for drones 1 and 2, `#/videos` the videos of all drones, `#/videos/1,2` of
 * these, `#/flights` the recorded flights, `#/flights/12` the replay of one, `#/flights/12/90` from its second 90,
 * `#/flights/import-<id>` that of an imported one, `#/flights/12/beside/13` of two, `#/flights/file` that of a
 * file of this computer, `#/statistics` their sums, `#/zones` the zones, `#/account/tokens` a section of the user's
 * account, `#/admin/users` one of the administration.
 */

import type { FlightKey } from './link/flight_imports';

/** The pages that each drone has. */
export type DronePage = 'control' | 'parameters' | 'logs' | 'missions' | 'setup';

export type Route =
  | { readonly page: 'monitor' | 'flights' | 'statistics' | 'zones' }
  /** `flight` null: a file of the person's computer. */
  | {
      readonly page: 'replay';
      readonly flight: FlightKey | null;
      readonly atS: number;
      readonly beside: FlightKey | null;
    }
  | { readonly page: Exclude<DronePage, 'missions' | 'setup'>; readonly droneId: number }
  | { readonly page: 'setup'; readonly droneId: number; readonly section: string }
  | { readonly page: 'missions'; readonly droneId: number | null }
  | { readonly page: 'squad-mission'; readonly droneIds: readonly number[] }
  /** Empty: all drones. */
  | { readonly page: 'videos'; readonly droneIds: readonly number[] }
  | { readonly page: 'account' | 'admin'; readonly section: string };

export function readRoute(hash: string): Route {
  const drone = /^#\/drone\/(\d+)(?:\/(parameters|logs))?$/.exec(hash);
  if (drone) return { page: (drone[2] ?? 'control') as 'control' | 'parameters' | 'logs', droneId: Number(drone[1]) };
  const setup = /^#\/drone\/(\d+)\/setup(?:\/([a-z-]*))?$/.exec(hash);
  if (setup) return { page: 'setup', droneId: Number(setup[1]), section: setup[2] ?? '' };
  const missions = /^#\/missions(?:\/(\d+))?$/.exec(hash);
  if (missions) return { page: 'missions', droneId: missions[1] === undefined ? null : Number(missions[1]) };
  const several = /^#\/(squad-mission|videos)(?:\/(\d+(?:,\d+)*))?$/.exec(hash);
  if (several) {
    return { page: several[1] as 'squad-mission' | 'videos', droneIds: several[2]?.split(',').map(Number) ?? [] };
  }
  const flight =
    /^#\/flights\/(?:file|(\d+|import-[0-9a-f]{16}))(?:\/(\d+(?:\.\d+)?))?(?:\/beside\/(\d+|import-[0-9a-f]{16}))?$/.exec(
      hash,
    );
  if (flight) {
    const [flown, beside] = [flight[1], flight[3]] as (FlightKey | undefined)[];
    return { page: 'replay', flight: flown ?? null, atS: Number(flight[2] ?? 0), beside: beside ?? null };
  }
  const sectioned = /^#\/(account|admin)(?:\/([a-z-]*))?$/.exec(hash);
  if (sectioned) return { page: sectioned[1] as 'account' | 'admin', section: sectioned[2] ?? '' };
  if (hash === statisticsHref) return { page: 'statistics' };
  return { page: hash === flightsHref ? 'flights' : hash === zonesHref ? 'zones' : 'monitor' };
}

export const monitorHref = '#/';
export const flightsHref = '#/flights';
export const statisticsHref = '#/statistics';
export const openFileHref = '#/flights/file';
/** `atS`: seconds from the beginning of the recording. */
export const replayHref = (flight: FlightKey, atS = 0, beside: FlightKey | null = null): string =>
  `#/flights/${flight}${atS > 0 ? `/${atS.toFixed(1)}` : ''}${beside === null ? '' : `/beside/${beside}`}`;
export const zonesHref = '#/zones';
export const controlHref = (droneId: number): string => `#/drone/${droneId}`;
export const squadMissionHref = (droneIds: readonly number[]): string => `#/squad-mission/${droneIds.join(',')}`;
export const videosHref = (droneIds: readonly number[] = []): string =>
  droneIds.length === 0 ? '#/videos' : `#/videos/${droneIds.join(',')}`;
export const parametersHref = (droneId: number): string => `#/drone/${droneId}/parameters`;
export const missionsHref = (droneId: number | null = null): string =>
  droneId === null ? '#/missions' : `#/missions/${droneId}`;
export const setupHref = (droneId: number, section = ''): string =>
  `#/drone/${droneId}/setup${section && `/${section}`}`;
export const logsHref = (droneId: number): string => `#/drone/${droneId}/logs`;
export const accountHref = (section = ''): string => `#/account${section && `/${section}`}`;
export const adminHref = (section = ''): string => `#/admin${section && `/${section}`}`;

export const navigation = $state({ route: readRoute(window.location.hash) });
window.addEventListener('hashchange', () => {
  navigation.route = readRoute(window.location.hash);
});
