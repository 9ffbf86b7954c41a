/** The squad list: the data of a row, and how the list is sorted, filtered and searched. Pure. */

import { t } from '../languages/text';
import { eitherSays } from '../link/drone_view';
import type { DroneState, FlightValues } from '../link/flight_values';
import type { HoldReading } from '../link/hold_view';
import type { LinkReading } from '../link/link_quality';
import type { Silence } from '../link/loss_countdown';
import type { Trouble } from '../link/trouble';
import { isUnattended } from '../link/unattended';
import type { Drone, User } from '../link/wire_types';

export interface SquadEntry {
  readonly drone: Drone;
  readonly values: FlightValues;
  readonly link: LinkReading | null;
  readonly hold: HoldReading | null;
  readonly trouble: Trouble | null;
  /** What it did when its link was lost; null: it is heard. */
  readonly silence: Silence | null;
}

export const FILTERS = ['all', 'mine', 'flying', 'unattended', 'attention', 'online', 'offline'] as const;
export type Filter = (typeof FILTERS)[number];

const SORT_KEYS = [
  'name',
  'state',
  'holder',
  'owner',
  'mode',
  'armed',
  'battery',
  'height',
  'speed',
  'climb',
  'throttle',
  'gps',
  'rtt',
  'loss',
  'time',
] as const;
export type SortKey = (typeof SORT_KEYS)[number];
export const isSortKey = (value: unknown): value is SortKey => SORT_KEYS.some((one) => one === value);

export interface Order {
  readonly key: SortKey;
  readonly isDescending: boolean;
}

const ATTENTION: Record<DroneState, number> = { alert: 0, flying: 2, armed: 3, lost: 4, idle: 5 };
/** Without trouble: after all that have some. */
const AFTER_TROUBLE = 1_000;

/** A person is lost, and the drone acts on its own or will. */
const isCounted = ({ hold }: SquadEntry): boolean => hold !== null && hold.phase !== 'quiet';

/** Smaller means more urgent: what is in trouble, the worst first (link/trouble.ts), then drones in flight. */
const attention = ({ trouble, values }: SquadEntry): number => trouble?.rank ?? AFTER_TROUBLE + ATTENTION[values.state];

const VALUE_OF: Record<SortKey, (entry: SquadEntry) => string | number | null> = {
  name: ({ drone }) => drone.name,
  state: attention,
  holder: ({ drone }) => drone.holder?.name ?? null,
  owner: ({ drone }) => drone.owners[0]?.name ?? null,
  mode: ({ values }) => values.mode,
  armed: ({ values }) => (values.armed === null ? null : Number(values.armed)),
  battery: ({ values }) => values.batteryPercent,
  height: ({ values }) => values.altRelM,
  speed: ({ values }) => values.groundSpeedMps,
  climb: ({ values }) => values.climbMps,
  throttle: ({ values }) => values.throttlePercent,
  gps: ({ values }) => values.satellites,
  rtt: ({ values }) => values.linkRttMs,
  loss: ({ link, values }) => link?.over30s.lossUpPercent ?? values.linkLossPercent,
  time: ({ values }) => values.airborneMs,
};

const collator = new Intl.Collator(undefined, { numeric: true, sensitivity: 'base' });

function compare(a: string | number, b: string | number): number {
  return typeof a === 'string' ? collator.compare(a, String(b)) : a - Number(b);
}

/** Unknown values come last in either direction; ties are sorted by name. */
export function sorted(entries: readonly SquadEntry[], { key, isDescending }: Order): SquadEntry[] {
  const valueOf = VALUE_OF[key];
  const sign = isDescending ? -1 : 1;
  return entries
    .map((entry) => ({ entry, value: valueOf(entry) }))
    .sort((a, b) => {
      if (a.value === null || b.value === null) {
        if (a.value !== b.value) return a.value === null ? 1 : -1;
      } else {
        const difference = sign * compare(a.value, b.value);
        if (difference !== 0) return difference;
      }
      return collator.compare(a.entry.drone.name, b.entry.drone.name) || a.entry.drone.id - b.entry.drone.id;
    })
    .map(({ entry }) => entry);
}

export function passes(entry: SquadEntry, filter: Filter, user: Pick<User, 'id'>): boolean {
  const { drone, values } = entry;
  switch (filter) {
    case 'all':
      return true;
    case 'mine':
      return drone.holder?.id === user.id || drone.assistant?.id === user.id;
    case 'flying':
      return eitherSays(values.airborne, drone.airborne) === true;
    case 'unattended':
      return isUnattended(drone, values);
    case 'attention':
      return entry.trouble !== null || isCounted(entry) || (values.state === 'lost' && drone.online);
    case 'online':
      return drone.online;
    case 'offline':
      return !drone.online;
  }
}

/** Every word must occur in a name, an owner, the holder or the mode. */
export function matches({ drone, values }: SquadEntry, search: string): boolean {
  const owners = drone.owners.map(({ name }) => name);
  const text = [drone.name, ...owners, drone.holder?.name ?? t('free'), values.mode ?? ''].join(' ').toLowerCase();
  return search
    .toLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word));
}

/** The visible part of a long list of rows of equal height, with some more on both sides. */
export function windowOf(
  count: number,
  rowPx: number,
  scrolledPx: number,
  heightPx: number,
): { readonly first: number; readonly end: number } {
  const MORE = 4;
  const first = Math.max(0, Math.min(count - 1, Math.floor(scrolledPx / rowPx)) - MORE);
  return { first, end: Math.min(count, Math.ceil((scrolledPx + heightPx) / rowPx) + MORE) };
}
