/** What can be found and done from the search, for this user, on this page, now. */

import { release } from '../control_actions';
import { overlay } from '../console_overlays.svelte';
import { say } from '../design/toasts';
import { commanded, shell } from '../flight_shell.svelte';
import { t } from '../languages/text';
import { mayTakeFree } from '../link/drone_view';
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
import { takeControl } from '../take_control';
import { tower } from '../tower.svelte';
import { chooseTheme } from '../user_choices.svelte';
import { holderWords, statusWords } from '../words/squad_words';
import { THEMES } from '../words/theme_words';
import { UNIT_SYSTEMS } from '../words/units';
import type { EntryKind, SearchEntry } from './search_entries';

const DRONE_PAGES = [
  [(drone: string) => t('Mission of {drone}', { drone }), missionsHref],
  [(drone: string) => t('Parameters of {drone}', { drone }), parametersHref],
  [(drone: string) => t('Setup of {drone}', { drone }), (droneId: number) => setupHref(droneId)],
  [(drone: string) => t('Logs of {drone}', { drone }), logsHref],
] as const;
/** Address and words of the sections of a page. */
type Sections = readonly (readonly [section: string, words: string])[];
const ACCOUNT: Sections = [
  ['password', t('password')],
  ['passkeys', t('passkeys')],
  ['second-factor', t('second factor')],
  ['sessions', t('sessions')],
  ['tokens', t('tokens')],
  ['teams', t('teams')],
];
const ADMIN: Sections = [
  ['users', t('users')],
  ['drones', t('drones')],
  ['enrolment', t('enrolment')],
  ['sessions', t('sessions')],
  ['tokens', t('tokens')],
  ['teams', t('teams')],
  ['audit', t('audit')],
  ['maps', t('maps')],
  ['system', t('system')],
];

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
  const detail = t('{status}, controls: {holder}', {
    status: statusWords(drone, values()),
    holder: holderWords(drone, user),
  });
  const found = [
    entry('drone', name, detail, go(controlHref(id))),
    ...DRONE_PAGES.map(([label, href]) => entry('page', label(name), '', go(href(id)))),
  ];
  if (isOwn) {
    const pilot = new PilotActions(vehicle, values);
    found.push(
      command(t('Hold {name}', { name }), t('at once'), () => void vehicle.sendHold()),
      command(
        t('Return {name}', { name }),
        t('asks'),
        asked(() => pilot.returnHome()),
      ),
      command(
        t('Land {name}', { name }),
        t('asks'),
        asked(() => pilot.land()),
      ),
    );
    if (drone.holder?.id === user.id)
      found.push(
        command(
          t('Release {name}', { name }),
          '',
          asked(() => release(drone)),
        ),
      );
  } else if (mayTakeFree(drone, user)) {
    found.push(command(t('Take control of {name}', { name }), '', () => void takeControl(drone, tell)));
  }
  return found;
}

export function consoleEntries(user: User): SearchEntry[] {
  const vehicles = tower.vehicles.get();
  const own = new Set(commanded(vehicles, user));
  const sections = (page: string, of: Sections, href: (section: string) => string): SearchEntry[] =>
    of.map(([section, words]) => entry('page', `${page}: ${words}`, '', go(href(section))));
  return [
    ...[...vehicles.values()].flatMap((vehicle) => ofDrone(vehicle, user, own.has(vehicle))),
    entry('page', t('Monitor'), t('map and list of the squad'), go(monitorHref)),
    entry('page', t('Missions'), t('plan, check, upload'), go(missionsHref())),
    entry('page', t('Flights'), t('recorded, to download'), go(flightsHref)),
    entry('page', t('Statistics'), t('hours, log book, maintenance'), go(statisticsHref)),
    entry('page', t('Zones'), t('where drones may not be'), go(zonesHref)),
    entry('page', t('Videos'), t('of all drones'), go(videosHref())),
    ...sections(t('Account'), ACCOUNT, accountHref),
    ...(user.role === 'admin' ? sections(t('Admin'), ADMIN, adminHref) : []),
    command(t('Alerts'), t('show or hide'), () => (shell.showsAlerts = !shell.showsAlerts)),
    command(preferences.sound ? t('Alert sounds off') : t('Alert sounds on'), '', () =>
      prefer({ sound: !preferences.sound }),
    ),
    command(t('Help for this page'), t('key ?'), () => (overlay.open = 'help')),
    command(t('Tour of the console'), '', () => {
      overlay.isTouring = true;
      window.location.hash = monitorHref;
    }),
    ...THEMES.map(({ value, label }) => command(t('Theme: {label}', { label }), '', () => chooseTheme(value))),
    ...UNIT_SYSTEMS.map(({ value, label }) =>
      command(t('Units: {label}', { label }), '', () => prefer({ units: value })),
    ),
    command(
      t('Sign out'),
      '',
      asked(() => tower.signOut()),
    ),
  ];
}
