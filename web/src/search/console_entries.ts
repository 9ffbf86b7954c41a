/** What can be found and done from the search, for this user, on this page, now. */

import { release } from '../control_actions';
import { overlay } from '../console_overlays.svelte';
import { say } from '../design/toasts';
import { commanded, shell } from '../flight_shell.svelte';
import { mayTakeUp } from '../link/drone_view';
import type { Vehicle } from '../link/vehicle';
import type { User } from '../link/wire_types';
import { wordsOf } from '../loading.svelte';
import { PilotActions } from '../pilot_actions';
import { prefer, preferences } from '../preferences.svelte';
import {
  accountHref,
  adminHref,
  controlHref,
  flightsHref,
  statisticsHref,
  logsHref,
  missionsHref,
  monitorHref,
  parametersHref,
  setupHref,
  videosHref,
  zonesHref,
} from '../route.svelte';
import { takeUp } from '../take_up';
import { tower } from '../tower.svelte';
import { chooseTheme } from '../user_choices.svelte';
import { holderWords, statusWords } from '../words/squad_words';
import { THEMES } from '../words/theme_words';
import { UNIT_SYSTEMS } from '../words/units';
import type { EntryKind, SearchEntry } from './search_entries';

const DRONE_PAGES = [
  ['Mission of', missionsHref],
  ['Parameters of', parametersHref],
  ['Setup of', (droneId: number) => setupHref(droneId)],
  ['Logs of', logsHref],
] as const;
const ACCOUNT = ['password', 'passkeys', 'second-factor', 'sessions', 'tokens', 'teams'];
const ADMIN = ['users', 'drones', 'enrolment', 'sessions', 'tokens', 'teams', 'audit', 'maps', 'system'];

const entry = (kind: EntryKind, label: string, detail: string, run: () => unknown): SearchEntry => ({
  id: `${kind} ${label} ${detail}`,
  kind,
  label,
  detail,
  run,
});
const go = (href: string) => (): void => {
  window.location.hash = href;
};
const tell = (why: string): void => {
  if (why) say(why, 'failed');
};
const asked = (work: () => Promise<unknown>) => (): void => {
  void work().catch((error: unknown) => tell(wordsOf(error)));
};
const command = (label: string, detail: string, run: () => unknown): SearchEntry =>
  entry('command', label, detail, run);

function ofDrone(vehicle: Vehicle, user: User, isOwn: boolean): SearchEntry[] {
  const drone = vehicle.drone.get();
  const { id, name } = drone;
  const values = () => vehicle.values(tower.clock.nowMs());
  const detail = `${statusWords(drone, values())}, controls: ${holderWords(drone, user)}`;
  const found = [
    entry('drone', name, detail, go(controlHref(id))),
    ...DRONE_PAGES.map(([label, href]) => entry('page', `${label} ${name}`, '', go(href(id)))),
  ];
  if (isOwn) {
    const pilot = new PilotActions(vehicle, values);
    found.push(
      command(`Hold ${name}`, 'at once', () => void vehicle.sendHold()),
      command(
        `Return ${name}`,
        'asks',
        asked(() => pilot.returnHome()),
      ),
      command(
        `Land ${name}`,
        'asks',
        asked(() => pilot.land()),
      ),
    );
    if (drone.holder?.id === user.id)
      found.push(
        command(
          `Release ${name}`,
          '',
          asked(() => release(drone)),
        ),
      );
  } else if (mayTakeUp(drone, user)) {
    found.push(command(`Take up the controls of ${name}`, '', () => void takeUp(drone, tell)));
  }
  return found;
}

export function consoleEntries(user: User): SearchEntry[] {
  const vehicles = tower.vehicles.get();
  const own = new Set(commanded(vehicles, user));
  const sections = (page: string, names: readonly string[], href: (section: string) => string): SearchEntry[] =>
    names.map((name) => entry('page', `${page}: ${name.replace('-', ' ')}`, '', go(href(name))));
  return [
    ...[...vehicles.values()].flatMap((vehicle) => ofDrone(vehicle, user, own.has(vehicle))),
    entry('page', 'Monitor', 'map and list of the squad', go(monitorHref)),
    entry('page', 'Missions', 'plan, check, upload', go(missionsHref())),
    entry('page', 'Flights', 'recorded, to download', go(flightsHref)),
    entry('page', 'Statistics', 'hours, log book, maintenance', go(statisticsHref)),
    entry('page', 'Zones', 'where drones may not be', go(zonesHref)),
    entry('page', 'Videos', 'of all drones', go(videosHref())),
    ...sections('Account', ACCOUNT, accountHref),
    ...(user.role === 'admin' ? sections('Admin', ADMIN, adminHref) : []),
    command('Alerts', 'show or hide', () => (shell.showsAlerts = !shell.showsAlerts)),
    command(preferences.sound ? 'Alert sounds off' : 'Alert sounds on', '', () =>
      prefer({ sound: !preferences.sound }),
    ),
    command('Help for this page', 'key ?', () => (overlay.open = 'help')),
    command('Tour of the console', '', () => {
      overlay.isTouring = true;
      window.location.hash = monitorHref;
    }),
    ...THEMES.map(({ value, label }) => command(`Theme: ${label}`, '', () => chooseTheme(value))),
    ...UNIT_SYSTEMS.map(({ value, label }) => command(`Units: ${label}`, '', () => prefer({ units: value }))),
    command(
      'Sign out',
      '',
      asked(() => tower.signOut()),
    ),
  ];
}
