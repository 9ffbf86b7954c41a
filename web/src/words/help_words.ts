/** The help of each page: what it is for, what to do first, and its keys. */

import { t } from '../languages/text';
import type { Route } from '../route.svelte';
import { SHORTCUTS } from '../shortcuts';

export interface Key {
  readonly key: string;
  readonly words: string;
}

export interface PageHelp {
  readonly title: string;
  readonly sentences: readonly string[];
  readonly keys: readonly Key[];
}

/** On every page. */
export const KEYS_EVERYWHERE: readonly Key[] = [
  { key: 'h', words: t('Hold the drone that you control, at once, with any dialog open') },
  { key: 'Ctrl k', words: t('Search drones, pages and commands') },
  { key: '?', words: t('This help') },
  { key: 'Esc', words: t('Closes what is open') },
];

const REPLAY_KEYS: readonly Key[] = [
  { key: 'Space', words: t('Play or pause') },
  { key: '← →', words: t('Five seconds back or ahead; with Shift thirty') },
  { key: ', .', words: t('A tenth of a second back or ahead') },
  { key: 'Home End', words: t('To the beginning or the end') },
  { key: '[ ]', words: t('Slower or faster') },
  { key: 'p n', words: t('To the event before or the next one') },
];

const CONTROL_KEYS: readonly Key[] = [
  ...SHORTCUTS.filter(({ name }) => name !== 'hold' && name !== 'help').map(({ key, words }) => ({
    key: key === key.toLowerCase() ? key : t('Shift {key}', { key }),
    words,
  })),
  { key: 'W S A D ↑ ↓ ← →', words: t('Sticks, while you fly by hand with the keyboard') },
];

export const HELP: Record<Route['page'], PageHelp> = {
  monitor: {
    title: t('Monitor'),
    sentences: [
      t('Map and list show every drone that you may see. A name opens its card, "Open" its page.'),
      t('Search, filter and sort the list, as cards, compact lines or a table; "Views" keeps what you chose.'),
      t('Select several drones to hold, return or land them, or to send them on a mission together.'),
      t('What is lost, low or held stands out on the map, in the list and in the flight bar.'),
    ],
    keys: [],
  },
  control: {
    title: t('One drone'),
    sentences: [
      t('Take control, then arm and take off: press and hold the button for a second.'),
      t('"Go to a place on the map" flies there. "Fly by hand" flies with a gamepad, keys or sticks on the screen.'),
      t('The check before flight says what the drone would do if it lost the tower.'),
    ],
    keys: CONTROL_KEYS,
  },
  missions: {
    title: t('Missions'),
    sentences: [
      t('Choose a tool beside the map and click where to fly, or open a file. The table edits each item.'),
      t('The tab Checks says what is wrong. Choose a drone above to compare, upload, start and follow the mission.'),
      t('Fence and rally points have tabs of their own.'),
    ],
    keys: [
      { key: 'Ctrl z', words: t('Undo; Ctrl y does it again') },
      { key: 'Ctrl s', words: t('Save the plan') },
      { key: 'u', words: t('Upload to the drone (asks)') },
      { key: '0', words: t('Show the whole plan') },
      { key: 'Enter', words: t('Ends what is being drawn') },
      { key: 'Delete', words: t('Removes what is selected') },
      { key: 'Shift ↑ ↓ ← →', words: t('Moves what is selected on the map') },
    ],
  },
  'squad-mission': {
    title: t('Squad mission'),
    sentences: [
      t('Choose the drones, draw the corners of the area on the map, and set height, speed and spacing.'),
      t('Each drone gets its part. Upload them all, then start all; "Hold all" stops every drone.'),
      t('While they fly, each shows how far it is and how long it still takes.'),
    ],
    keys: [],
  },
  videos: {
    title: t('Videos'),
    sentences: [
      t('The pictures of several drones beside each other. Choose the drones in the squad list, then "Videos".'),
      t('A drone sends nothing that nobody watches: pictures out of sight stop.'),
    ],
    keys: [],
  },
  parameters: {
    title: t('Parameters'),
    sentences: [
      t('Search by name or by what a parameter does. A changed value waits until you write it.'),
      t('Take control to write. Compare with a file, the defaults or another drone.'),
    ],
    keys: [{ key: '/', words: t('To the search') }],
  },
  setup: {
    title: t('Vehicle setup'),
    sentences: [
      t('Calibrate sensors and radio, test motors with the propellers off, and set modes, failsafes, fence and power.'),
      t('Take control first. The tower does this only when the drone is on the ground and disarmed.'),
      t('A changed value waits until you write it.'),
    ],
    keys: [],
  },
  logs: {
    title: t('Flight logs'),
    sentences: [
      t('Ask the drone for the list of its logs, fetch one to the tower on the ground, then download it.'),
      t('Recorded videos of the drone are below.'),
    ],
    keys: [],
  },
  flights: {
    title: t('Flights'),
    sentences: [
      t('Every flight that the tower recorded, the newest first. Find them by drone, pilot and date.'),
      t('Replay opens a flight on the map, with its flight display, sticks, events and charts.'),
      t('Download a flight as .tlog for other ground stations, or as CSV, KML or GPX.'),
      t('Open a file replays a .tlog of your own. It stays on your computer.'),
      t('Import a file takes a .tlog, .bin (ArduPilot) or .ulg (PX4) into the tower: only you and admins see it.'),
    ],
    keys: [],
  },
  statistics: {
    title: t('Statistics'),
    sentences: [
      t('Recorded flights summed up: hours, distance and incidents by drone, by pilot and by month.'),
      t('My log book has the flights in which you had the controls. Each table can be downloaded as CSV.'),
      t(
        'Maintenance shows what a drone needs after so many hours in the air. Owners and admins add it, and say when it is done.',
      ),
    ],
    keys: [],
  },
  replay: {
    title: t('Replay'),
    sentences: [
      t('A recorded flight on one timeline: move along it, or press an event to see that moment.'),
      t('Share copies an address of this moment. Whoever opens it must be allowed to see the flight.'),
      t('The report lists who had the controls, commands with answers, holds and alerts, for print or PDF.'),
    ],
    keys: REPLAY_KEYS,
  },
  zones: {
    title: t('Zones'),
    sentences: [
      t('Where drones may not be, not above a height, or only. Every map shows them.'),
      t('Admins draw zones for the tower, admins of a team for its drones: on the map, or from a GeoJSON or KML file.'),
      t('A zone refuses plans and go-tos into it, and holds a drone that is flown by hand at it; or it only warns.'),
    ],
    keys: [],
  },
  account: {
    title: t('Your account'),
    sentences: [
      t('Password, passkeys and second factor; sessions that you can end; tokens for programs; your teams.'),
      t('The tower asks for your password again before it changes how you sign in.'),
    ],
    keys: [],
  },
  admin: {
    title: t('Administration'),
    sentences: [
      t(
        'Users and their roles, drones and their owners, enrolment of a drone by one command, teams, sessions, tokens.',
      ),
      t(
        'The audit trail tells who did what. Maps: layers, files, and areas kept for when the network is away. System shows the health of the tower.',
      ),
    ],
    keys: [],
  },
};
