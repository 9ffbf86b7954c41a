/**
 * The alerts of the squad, as the tower decides them (docs/alerts.md): this page shows them and judges nothing. It adds
 * one of its own: that it has lost the tower.
 */

import { t } from '../languages/text';
import type { Clock } from './clock';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';
import { Store, type Readable } from './store';

export type AlertSeverity = Schemas['Severity'];
/** `drone_id` is null for the page's own alert, and for those about the tower itself, which only admins get. */
export type Alert = Schemas['AlertView'];

export interface AlertEvent {
  readonly type: 'alert';
  readonly alert: Schemas['AlertView'];
}

/** What this page knows without the tower. */
export type OwnAlert = Pick<Alert, 'words' | 'severity'>;
type AlertRest = Pick<Rest, 'acknowledgeAlert' | 'pastAlerts'>;

/** Above this limit, drops the oldest of those that are over. */
export const ALERT_LIMIT = 300;
/** The id of the page's own alert; those of the tower are not negative. */
export const OWN_ID = -1;

const SEVERITIES: Record<AlertSeverity, number> = { critical: 0, warning: 1, notice: 2 };

export class Alerts {
  readonly #list = new Store<readonly Alert[]>([]);
  /** The open alerts of each drone, the most urgent first. */
  #byDrone: ReadonlyMap<number, readonly Alert[]> = new Map();
  readonly #clock: Clock;
  readonly #rest: AlertRest;

  constructor(clock: Clock, rest: AlertRest) {
    this.#clock = clock;
    this.#rest = rest;
  }

  /** Oldest first. */
  get list(): Readable<readonly Alert[]> {
    return this.#list;
  }

  /** The open alerts of one drone, the most urgent first. */
  of(droneId: number): readonly Alert[] {
    return this.#byDrone.get(droneId) ?? [];
  }

  /** A new connection: whatever was open and is not among these is no longer known. The past is read again. */
  welcome(alerts: readonly Alert[]): void {
    const past = this.#list.get().filter((one) => !isLasting(one) && !needsSomebody(one));
    this.#set([...past, ...alerts]);
    void this.#rest
      .pastAlerts()
      .then((read) => this.past(read))
      .catch(() => undefined); // the list then begins with what is open
  }

  /** An alert as it is now. */
  take(alert: Alert): void {
    this.#set([...this.#list.get().filter(({ id }) => id !== alert.id), alert]);
  }

  /** Alerts of the past, which say nothing about those that are known already. */
  past(alerts: readonly Alert[]): void {
    const known = new Set(this.#list.get().map(({ id }) => id));
    // One that is open in an older answer, and unknown here, is over.
    this.#set([...alerts.filter((one) => !known.has(one.id) && !isLasting(one)), ...this.#list.get()]);
  }

  /** The user may no longer see the drone. */
  gone(droneId: number): void {
    this.#set(this.#list.get().filter((one) => one.drone_id !== droneId && one.other_id !== droneId));
  }

  /** The page's own alert begins or ends (null). One that goes on keeps its beginning and its acknowledgement. */
  own(own: OwnAlert | null): void {
    const known = this.#list.get().find(({ id }) => id === OWN_ID);
    if (own === null) {
      if (known) this.#set(this.#list.get().filter(({ id }) => id !== OWN_ID));
      return;
    }
    if (known?.words !== own.words) this.take({ ...OWN, opened_at: this.#now(), ...known, ...own });
  }

  /** For everybody who sees the drone. Raises RestError. */
  async acknowledge(alert: Alert): Promise<void> {
    if (alert.id === OWN_ID) this.take({ ...alert, acknowledged_at: this.#now() });
    else this.take(await this.#rest.acknowledgeAlert(alert.id));
  }

  /** Several at once. One that the tower no longer has is over: nothing is lost with it. */
  async acknowledgeAll(alerts: readonly Alert[]): Promise<void> {
    await Promise.allSettled(alerts.map((alert) => this.acknowledge(alert)));
  }

  clear(): void {
    this.#set([]);
  }

  #now(): string {
    return new Date(this.#clock.nowMs()).toISOString();
  }

  #set(alerts: readonly Alert[]): void {
    const list = bounded(
      [...alerts].sort((a, b) => (a.opened_at < b.opened_at ? -1 : a.opened_at > b.opened_at ? 1 : 0)),
    );
    const byDrone = new Map<number, Alert[]>();
    for (const alert of list) {
      for (const id of new Set([alert.drone_id, alert.other_id])) {
        if (id !== null && isLasting(alert)) byDrone.set(id, [...(byDrone.get(id) ?? []), alert]);
      }
    }
    for (const open of byDrone.values()) open.sort((a, b) => a.rank - b.rank);
    this.#byDrone = byDrone;
    this.#list.set(list);
  }
}

const OWN: Alert = {
  id: OWN_ID,
  rule: 'page-alone',
  severity: 'warning',
  badge: t('Tower lost'),
  words: '',
  advice: t('Check the network. Use another page or another way to reach the drone.'),
  rank: 0,
  drone_id: null,
  other_id: null,
  opened_at: '',
  acknowledged_at: null,
  acknowledged_by: null,
  closed_at: null,
  closed_why: '',
};

function bounded(all: readonly Alert[]): readonly Alert[] {
  let surplus = all.length - ALERT_LIMIT;
  return surplus <= 0 ? all : all.filter((one) => isLasting(one) || needsSomebody(one) || surplus-- <= 0);
}

/** It is not over. */
export const isLasting = (alert: Alert): boolean => alert.closed_at === null;

const isUnread = ({ acknowledged_at, severity }: Alert): boolean => acknowledged_at === null && severity !== 'notice';

/** A person has to see to it, and none has: it lasts, or was critical. */
export const needsSomebody = (alert: Alert): boolean =>
  isUnread(alert) && (isLasting(alert) || alert.severity === 'critical');

/** It lasts, and nobody has seen to it: act now. */
export const isNow = (alert: Alert): boolean => isUnread(alert) && isLasting(alert);

/** It is over and was critical, and nobody has read it: there is time for that. */
export const isToRead = (alert: Alert): boolean => needsSomebody(alert) && !isLasting(alert);

/** Rules about what no command changes any more. */
const PAST_HELP: ReadonlySet<string> = new Set(['crashed', 'motors-stopped', 'falls', 'link-lost']);

const NOBODYS: ReadonlySet<number> = new Set();

/**
 * What lasts before what is over, and in both what nobody has seen to first. Then one's own drones before others', the
 * worst first, what can still be changed before what cannot, and the newest first. `own`: the drones that this user
 * commands.
 */
export function byUrgency(all: readonly Alert[], own: ReadonlySet<number> = NOBODYS): Alert[] {
  const group = (alert: Alert): number => (isLasting(alert) ? 0 : 2) + (needsSomebody(alert) ? 0 : 1);
  const isOthers = ({ drone_id, other_id }: Alert): number =>
    [drone_id, other_id].some((id) => id !== null && own.has(id)) ? 0 : 1;
  const isPastHelp = ({ rule }: Alert): number => (PAST_HELP.has(rule) ? 1 : 0);
  return [...all].sort(
    (a, b) =>
      group(a) - group(b) ||
      (isLasting(a)
        ? isOthers(a) - isOthers(b) ||
          SEVERITIES[a.severity] - SEVERITIES[b.severity] ||
          isPastHelp(a) - isPastHelp(b) ||
          a.rank - b.rank
        : 0) ||
      (a.opened_at < b.opened_at ? 1 : a.opened_at > b.opened_at ? -1 : 0),
  );
}

/** Repeats of one alert: the same rule about the same drones. */
export interface AlertGroup {
  /** The most urgent one of them. */
  readonly alert: Alert;
  /** All of them, the most urgent first. */
  readonly all: readonly Alert[];
}

/** The texts of an autopilot share a rule: two of them are the same if they differ in figures alone. */
const BY_WORDS: ReadonlySet<string> = new Set(['failsafe', 'autopilot-error']);

/** `ordered`: as `byUrgency` returns them. Each group stands where its most urgent alert stood. */
export function folded(ordered: readonly Alert[]): AlertGroup[] {
  const groups = new Map<string, Alert[]>();
  for (const alert of ordered) {
    const { rule, drone_id, other_id, words } = alert;
    const key = [rule, drone_id, other_id, BY_WORDS.has(rule) ? words.replace(/[\d.,]+/g, '#') : ''].join('|');
    const group = groups.get(key);
    if (group) group.push(alert);
    else groups.set(key, [alert]);
  }
  return [...groups.values()].flatMap((all) => (all[0] ? [{ alert: all[0], all }] : []));
}

/** The worst severity of what needs somebody now. */
export const worstOpen = (all: readonly Alert[]): AlertSeverity | null => {
  const severities = all.filter(isNow).map(({ severity }) => severity);
  return severities.includes('critical') ? 'critical' : severities.includes('warning') ? 'warning' : null;
};

export interface AlertCounts {
  readonly now: number;
  readonly toRead: number;
}

/** Repeats count once. */
export function alertCounts(all: readonly Alert[]): AlertCounts {
  return { now: folded(all.filter(isNow)).length, toRead: folded(all.filter(isToRead)).length };
}
