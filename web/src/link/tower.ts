/**
 * The console's whole connection to the tower: REST, the live socket, and one `Vehicle` for each drone of the
 * squad. Views read its stores; none of them talks to a socket.
 */

import { realClock, type Clock } from './clock';
import { controlWords, holdWords } from './event_words';
import { Journal, type Entry, type Severity } from './journal';
import { Live, liveUrl, SUBPROTOCOL, type SocketLike } from './live';
import { Rest, RestError, type ControlAction } from './rest';
import { Store } from './store';
import { splitTagged } from './tagged_frames';
import { Vehicle } from './vehicle';
import type { ControlEvent, Drone, HoldEvent, NoticeEvent, TowerEvent, User } from './wire_types';

/** Notices after which our commands cannot have reached the drone. */
const REFUSING_NOTICES = new Set(['not-in-control', 'offline', 'unknown-drone', 'malformed']);

export interface TowerOptions {
  readonly clock?: Clock;
  readonly rest?: Rest;
  readonly openSocket?: () => SocketLike;
}

export class Tower {
  readonly clock: Clock;
  readonly rest: Rest;
  readonly live: Live;
  readonly user = new Store<User | null>(null);
  readonly vehicles = new Store<ReadonlyMap<number, Vehicle>>(new Map());
  readonly journal = new Journal();
  /** The newest change of the controls of a drone that this user had or has. */
  readonly controlChange = new Store<ControlEvent | null>(null);
  readonly holds = new Store<ReadonlyMap<number, HoldEvent>>(new Map());
  #entries = 0;

  constructor(options: TowerOptions = {}) {
    this.clock = options.clock ?? realClock;
    this.rest = options.rest ?? new Rest();
    this.live = new Live({
      clock: this.clock,
      openSocket: options.openSocket ?? openBrowserSocket,
      onEvent: (event) => this.#onEvent(event),
      onFrames: (message) => this.#onFrames(message),
    });
    this.live.state.subscribe(({ phase, failures }) => {
      if (phase === 'waiting') {
        this.#abortAll('the connection broke before an answer came; it may have been carried out');
        // A tower that refuses the upgrade looks like a network fault from here: ask which of the two it is.
        if (failures === 1 || failures % 4 === 0) void this.#checkSession();
      }
      if (phase === 'signed-out') this.#forget();
    });
  }

  /** Signed in already (a cookie from before)? Then go live. */
  async resume(): Promise<void> {
    const user = await this.rest.me();
    this.user.set(user);
    this.live.start();
  }

  async signIn(name: string, password: string): Promise<void> {
    this.user.set(await this.rest.signIn(name, password));
    this.live.start();
  }

  async signOut(): Promise<void> {
    await this.rest.signOut();
    this.live.stop();
    this.#forget();
  }

  async control(droneId: number, action: ControlAction, reason?: string): Promise<void> {
    this.#putDrone(await this.rest.control(droneId, action, reason));
  }

  record(entry: Omit<Entry, 'key' | 'atMs'>): void {
    this.journal.add({ ...entry, key: `tower-${++this.#entries}`, atMs: this.clock.nowMs() });
  }

  #onEvent(event: TowerEvent): void {
    switch (event.type) {
      case 'welcome':
        this.user.set(event.user);
        this.#setSquad(event.drones);
        break;
      case 'drone':
        this.#putDrone(event.drone);
        break;
      case 'drone_removed':
        this.#setSquad(this.#squad().filter((drone) => drone.id !== event.drone_id));
        break;
      case 'link': {
        const vehicle = this.vehicles.get().get(event.drone_id);
        if (vehicle) vehicle.link = event;
        break;
      }
      case 'control':
        this.#onControl(event);
        break;
      case 'hold':
        this.holds.update((holds) => new Map(holds).set(event.drone_id, event));
        this.#say(event.drone_id, event.step === 'unconfirmed' ? 'error' : 'info', holdWords(event));
        break;
      case 'notice':
        this.#onNotice(event);
        break;
      case 'lost':
        this.#say(
          event.drone_id,
          'warning',
          `${event.count} messages of this drone were lost: this browser is too slow`,
        );
        break;
    }
  }

  #onControl(event: ControlEvent): void {
    const me = this.user.get();
    const name = this.vehicles.get().get(event.drone_id)?.drone.get().name ?? `drone ${event.drone_id}`;
    const isOurs = me !== null && event.by?.id === me.id;
    this.#say(event.drone_id, isOurs ? 'info' : 'warning', controlWords(event, name));
    this.controlChange.set(event);
    if (event.holder?.id !== me?.id) this.vehicles.get().get(event.drone_id)?.abort('we no longer have the controls');
  }

  #onNotice({ severity, code, text, drone_id, count }: NoticeEvent): void {
    this.#say(drone_id, severity, count > 1 ? `${text} (${count} times)` : text);
    if (drone_id !== null && REFUSING_NOTICES.has(code)) this.vehicles.get().get(drone_id)?.abort(text);
  }

  #onFrames(message: Uint8Array): void {
    const nowMs = this.clock.nowMs();
    const vehicles = this.vehicles.get();
    for (const { droneId, frame } of splitTagged(message) ?? []) vehicles.get(droneId)?.receive(frame, nowMs);
  }

  #squad(): Drone[] {
    return [...this.vehicles.get().values()].map((vehicle) => vehicle.drone.get());
  }

  #putDrone(drone: Drone): void {
    const known = this.vehicles.get().get(drone.id);
    // REST answers and live events overtake each other: an older epoch is old news.
    if (known && drone.epoch < known.drone.get().epoch) return;
    this.#setSquad([...this.#squad().filter(({ id }) => id !== drone.id), drone]);
  }

  #setSquad(drones: readonly Drone[]): void {
    const before = this.vehicles.get();
    const next = new Map<number, Vehicle>();
    for (const drone of [...drones].sort((a, b) => a.id - b.id)) {
      const vehicle = before.get(drone.id) ?? this.#newVehicle(drone);
      vehicle.drone.set(drone);
      next.set(drone.id, vehicle);
    }
    this.vehicles.set(next);
    this.live.expectTraffic(drones.some((drone) => drone.online));
  }

  #newVehicle(drone: Drone): Vehicle {
    return new Vehicle(
      drone,
      this.clock,
      (message) => this.live.send(message),
      (entry) => this.journal.add(entry),
    );
  }

  #say(droneId: number | null, severity: Severity, text: string): void {
    this.record({ droneId, source: 'tower', severity, text });
  }

  #abortAll(why: string): void {
    for (const vehicle of this.vehicles.get().values()) vehicle.abort(why);
  }

  async #checkSession(): Promise<void> {
    try {
      await this.rest.me();
    } catch (error) {
      if (error instanceof RestError && error.status === 401) {
        this.live.stop();
        this.#forget();
      }
    }
  }

  /** What one user saw is not shown to the next. */
  #forget(): void {
    this.#abortAll('signed out');
    this.user.set(null);
    this.vehicles.set(new Map());
    this.holds.set(new Map());
    this.controlChange.set(null);
    this.journal.clear();
  }
}

function openBrowserSocket(): SocketLike {
  return new WebSocket(liveUrl(window.location), SUBPROTOCOL) as SocketLike;
}
