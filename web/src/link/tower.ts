/**
 * The console's whole connection to the tower: REST, the live socket, and one `Vehicle` for each drone of the squad.
 * Views read its stores; none of them uses a socket.
 */

import { t } from '../languages/text';
import { realClock, type Clock } from './clock';
import type { Enrolment } from './admin_types';
import { Alerts } from './alerts';
import { AssistTurns } from './assist_turns';
import { mayCommand, readDrone } from './drone_view';
import { causeWords, controlWords, farewellWords, holdWords, orderReason, rehearsalWords } from './event_words';
import { FINAL_STEPS, nextHold } from './hold_log';
import { Journal, type Entry, type Severity } from './journal';
import { Live, openBrowserSocket, type SocketLike } from './live';
import { LossChecks } from './loss_checks';
import { LostControlsLog } from './lost_controls';
import type { Operation } from './operation_types';
import { isOver, Operations } from './operations';
import { aloneWords } from './page_alone';
import { ParameterTables } from './parameter_tables';
import { Recordings } from './recordings';
import { nextRehearsal } from './rehearsal_log';
import type { PasskeyCredential } from './passkeys';
import { outcomeOfCommand } from './drone_commands';
import { Rest, RestError, type ControlAction, type ControlWords, type SecondFactorAnswer } from './rest';
import { mayGoLive } from './signed_in';
import { Separations } from './separation';
import { Squad } from './squad';
import { Store } from './store';
import { Surroundings } from './surroundings';
import { splitTagged } from './tagged_frames';
import { eventInWords } from './tower_words';
import { Vehicle } from './vehicle';
import type { ControlEvent, Drone, HoldEvent, NoticeEvent, TowerEvent, User } from './wire_types';

/** After these notices our commands cannot have reached the drone. */
const REFUSING_NOTICES = new Set([
  'not-in-control',
  'offline',
  'unknown-drone',
  'malformed',
  'assisted',
  'not-allowed',
  'loss-check',
]);

export interface TowerOptions {
  readonly clock?: Clock;
  readonly rest?: Rest;
  readonly openSocket?: () => SocketLike;
  /** The clock of the stick stream; defaults to `clock`. */
  readonly beatClock?: Clock;
}

export class Tower {
  readonly clock: Clock;
  readonly rest: Rest;
  readonly live: Live;
  readonly user = new Store<User | null>(null);
  readonly journal = new Journal();
  readonly alerts: Alerts;
  readonly separations = new Separations();
  readonly around: Surroundings;
  readonly lostControls = new LostControlsLog();
  readonly assist: AssistTurns;
  readonly lossChecks: LossChecks;
  readonly operations: Operations;
  readonly parameterTables: ParameterTables;
  readonly recordings: Recordings;
  /** The most recently changed enrolment of a drone; for admins. */
  readonly enrolment = new Store<Enrolment | null>(null);
  /** Why the tower signed us out, and what we were flying; empty after our own sign-out. */
  readonly farewell = new Store('');
  /** Since when the tower is silent; null while it is not. */
  readonly deafSinceMs = new Store<number | null>(null);
  readonly #squad: Squad;
  #entries = 0;

  constructor(options: TowerOptions = {}) {
    this.clock = options.clock ?? realClock;
    this.rest = options.rest ?? new Rest();
    this.alerts = new Alerts(this.clock, this.rest);
    this.around = new Surroundings(this.rest, this.user);
    this.operations = new Operations(this.rest);
    this.parameterTables = new ParameterTables(this.rest, this.operations);
    this.recordings = new Recordings(this.clock, this.rest);
    this.assist = new AssistTurns(this.clock);
    this.lossChecks = new LossChecks(this.clock, (droneId) => this.readLossCheck(droneId));
    this.live = new Live({
      clock: this.clock,
      openSocket: options.openSocket ?? openBrowserSocket,
      onEvent: (event) => this.#onEvent(eventInWords(event)),
      onFrames: (message) => this.#onFrames(message),
    });
    this.#squad = new Squad({
      clock: this.clock,
      user: this.user,
      lostControls: this.lostControls,
      assist: this.assist,
      alerts: this.alerts,
      separations: this.separations,
      newVehicle: (drone) => this.#newVehicle(drone, options.beatClock ?? this.clock),
    });
    this.vehicles.subscribe(() => this.live.expectTraffic(this.#squad.drones().some((drone) => drone.online)));
    this.live.state.subscribe(({ phase, failures, why }) => {
      if (phase === 'open') this.deafSinceMs.set(null);
      else if (this.live.heardAtMs !== null) this.deafSinceMs.update((since) => since ?? this.live.heardAtMs);
      if (phase === 'waiting') {
        this.#abortAll(t('the connection broke before the answer; the command may have been carried out'));
        // A refused upgrade looks like a network fault here: checks which of the two it is.
        if (failures === 1 || failures % 4 === 0) void this.#checkSession();
      }
      if (phase === 'signed-out') this.#signedOut(why);
    });
  }

  get vehicles(): Store<ReadonlyMap<number, Vehicle>> {
    return this.#squad.vehicles;
  }

  /** Goes live if a session exists (a cookie from before). */
  async resume(): Promise<void> {
    this.#signedIn(await this.rest.me());
  }

  async signIn(name: string, password: string, second: SecondFactorAnswer = {}): Promise<void> {
    this.#signedIn(await this.rest.signIn(name, password, second));
    this.farewell.set('');
  }

  async signInWithPasskey(credential: PasskeyCredential): Promise<void> {
    this.#signedIn(await this.rest.signInWithPasskey(credential));
    this.farewell.set('');
  }

  /**
   * The tower ends every session of the user and begins a new one for this page: the live connection follows. A refusal
   * changes nothing.
   */
  async changePassword(oldPassword: string, newPassword: string, keepTokens = false): Promise<void> {
    const isLive = mayGoLive(this.user.get());
    if (isLive) this.live.move();
    try {
      const user = await this.rest.changePassword(oldPassword, newPassword, keepTokens);
      if (isLive) this.live.moved(true);
      this.#signedIn(user);
    } catch (error) {
      if (isLive) this.live.moved(false);
      throw error;
    }
  }

  async signOut(): Promise<void> {
    await this.rest.signOut();
    this.live.stop();
    this.#forget();
    this.farewell.set(''); // the tower may have closed the connection first
  }

  async control(droneId: number, action: ControlAction, words: ControlWords = {}): Promise<void> {
    const drone = () => this.vehicles.get().get(droneId)?.drone.get();
    const before = drone();
    const answer = await this.rest.control(droneId, action, words);
    const now = drone();
    // The live channel's state is newer: the answer does not yet include the hold that it began.
    if (now !== undefined && now !== before && now.epoch >= answer.epoch) return;
    this.#squad.put(answer);
  }

  /** Reads the check before flight again. */
  async readLossCheck(droneId: number): Promise<void> {
    const check = await this.rest.lossCheck(droneId);
    this.vehicles.get().get(droneId)?.lossCheck.set(check);
  }

  async acknowledgeLossCheck(droneId: number, droneName: string): Promise<void> {
    const check = await this.rest.acknowledgeLossCheck(droneId, droneName);
    this.vehicles.get().get(droneId)?.lossCheck.set(check);
  }

  record(entry: Omit<Entry, 'key' | 'atMs'>): void {
    this.journal.add({ ...entry, key: `tower-${++this.#entries}`, atMs: this.clock.nowMs() });
  }

  /** Once a second is enough: what ends by time alone, and whether this page is alone. */
  look(): void {
    this.separations.look(this.clock.nowMs());
    this.alerts.own(aloneWords(this.deafSinceMs.get(), this.#squad.drones(), this.user.get(), this.clock.nowMs()));
  }

  /** With a first password a user may only change it: no live connection before that. */
  #signedIn(user: User): void {
    this.user.set(user);
    if (mayGoLive(user)) this.live.start();
    else this.live.stop();
  }

  #onEvent(event: TowerEvent): void {
    this.around.take(event);
    switch (event.type) {
      case 'welcome':
        this.user.update((known) => (known?.id === event.user.id ? { ...known, ...event.user } : event.user));
        this.#squad.setTowerTime(event.server_time);
        this.#welcome(event.drones.map(readDrone));
        this.alerts.welcome(event.alerts ?? []);
        this.separations.connected(this.clock.nowMs());
        break;
      case 'drone':
        this.#squad.put(readDrone(event.drone));
        break;
      case 'enrolment':
        this.enrolment.set(event.enrolment);
        break;
      case 'drone_removed':
        this.#squad.remove(event.drone_id);
        break;
      case 'links':
        this.#squad.links(event.links);
        break;
      case 'control':
        this.#onControl(event);
        break;
      case 'hold':
        this.#onHold(event);
        break;
      case 'turn':
        this.assist.turn(event.drone_id, event.user);
        break;
      case 'rehearsal':
        this.vehicles
          .get()
          .get(event.drone_id)
          ?.rehearsal.update((last) => nextRehearsal(last, event));
        this.#say(event.drone_id, event.phase === 'failed' ? 'error' : 'info', rehearsalWords(event.text));
        break;
      case 'loss_check':
        this.lossChecks.changed(event.drone_id);
        break;
      case 'notice':
        this.#onNotice(event);
        break;
      case 'operation':
        this.#onOperation(event.operation);
        break;
      case 'plan_on_board':
        this.vehicles.get().get(event.drone_id)?.onBoard(event);
        break;
      case 'parameters':
        this.vehicles.get().get(event.drone_id)?.parameters.set(event);
        break;
      case 'recording':
        this.recordings.take(event);
        break;
      case 'separation':
        this.separations.take(event);
        break;
      case 'alert':
        this.alerts.take(event.alert);
        break;
      case 'lost':
        this.#say(
          event.drone_id,
          'warning',
          t('{count} messages of this drone were lost because this browser is too slow', { count: event.count }),
        );
        break;
    }
  }

  #onControl(event: ControlEvent): void {
    const me = this.user.get();
    const name = this.#nameOf(event.drone_id);
    const isOurs = me !== null && event.by?.id === me.id;
    this.#say(event.drone_id, isOurs ? 'info' : 'warning', controlWords(event, name));
    this.lostControls.control(event, name, me, this.clock.nowMs());
    const vehicle = this.vehicles.get().get(event.drone_id);
    if (vehicle && me && !mayCommand(vehicle.drone.get(), me)) vehicle.abort(t('we no longer have the controls'));
  }

  /** Includes a drone that has just left our squad: its last event is about its controls. */
  #nameOf(droneId: number): string {
    const lost = this.lostControls.losses.get().get(droneId);
    return this.vehicles.get().get(droneId)?.drone.get().name ?? lost?.droneName ?? t('drone {droneId}', { droneId });
  }

  #onHold(event: HoldEvent): void {
    const nowMs = this.clock.nowMs();
    const vehicle = this.vehicles.get().get(event.drone_id);
    vehicle?.holdLog.set(nextHold(vehicle.holdLog.get(), event, nowMs));
    // Whatever ordered the hold: manual flight resumes only when the pilot starts it again.
    const cause = causeWords(event.cause ?? 'order', orderReason(event));
    if (event.step === 'ordered') vehicle?.manual.stop(t('it was put on hold ({cause})', { cause }), { holds: false });
    // The strip over the map shows the steps in between: here they would displace important entries.
    if (event.step !== 'ordered' && !FINAL_STEPS.has(event.step)) return;
    this.#say(event.drone_id, event.step === 'unconfirmed' ? 'error' : 'info', holdWords(event));
  }

  #onOperation(operation: Operation): void {
    const isNews = this.operations.put(operation);
    const { work, state, words, drone_id } = operation;
    // Commands have their own journal entries, from their senders.
    if (!isNews || !isOver(operation) || words === '' || !work.startsWith('plan_')) return;
    this.#say(drone_id, state === 'done' ? 'info' : 'error', words);
  }

  #onNotice({ severity, code, text, drone_id, count }: NoticeEvent): void {
    this.#say(drone_id, severity, count > 1 ? t('{text} ({count} times)', { text, count }) : text);
    const vehicle = drone_id === null ? undefined : this.vehicles.get().get(drone_id);
    if (!vehicle) return;
    if (REFUSING_NOTICES.has(code)) vehicle.abort(text);
    if (code === 'other-hands')
      vehicle.manual.stop(t('it is flown from another window or program of yours'), { holds: false });
    if (code === 'assisted') this.assist.refused(vehicle.drone.get());
    if (code === 'loss-check') void this.readLossCheck(vehicle.drone.get().id).catch(() => undefined);
  }

  #onFrames(message: Uint8Array): void {
    const nowMs = this.clock.nowMs();
    const vehicles = this.vehicles.get();
    for (const { droneId, frame } of splitTagged(message) ?? []) vehicles.get(droneId)?.receive(frame, nowMs);
  }

  /** The whole state again: no events explain changes during the absence. */
  #welcome(drones: readonly Drone[]): void {
    this.#squad.replace(drones);
    for (const vehicle of this.vehicles.get().values()) vehicle.rehearsal.set(null); // its end went unreported
    for (const drone of drones) this.lostControls.unexplained(drone, this.clock.nowMs());
    this.lossChecks.allChanged();
    void this.operations.reread();
    this.recordings.reread();
  }

  #newVehicle(drone: Drone, beatClock: Clock): Vehicle {
    return new Vehicle(
      drone,
      this.clock,
      {
        command: (droneId, command) => outcomeOfCommand(this.operations, droneId, command),
        send: (message) => this.live.send(message),
        sendFresh: (message) => this.live.sendFresh(message),
        alerts: (droneId) => this.alerts.of(droneId),
      },
      (entry) => this.journal.add(entry),
      beatClock,
    );
  }

  #say(droneId: number | null, severity: Severity, text: string): void {
    this.record({ droneId, source: 'tower', severity, text });
  }

  #abortAll(why: string): void {
    for (const vehicle of this.vehicles.get().values()) {
      vehicle.manual.stop(why, { holds: false });
      vehicle.abort(why);
    }
  }

  async #checkSession(): Promise<void> {
    try {
      const user = await this.rest.me();
      if (!mayGoLive(user)) this.#signedIn(user);
    } catch (error) {
      if (error instanceof RestError && error.status === 401) {
        this.live.stop();
        this.#signedOut(error.message);
      }
    }
  }

  /** The tower ended the session: tells the user why, and that they no longer fly. */
  #signedOut(why: string): void {
    const me = this.user.get();
    const flown = this.#squad.drones().filter(({ holder }) => me !== null && holder?.id === me.id);
    this.#forget();
    this.farewell.set(
      farewellWords(
        why,
        flown.map(({ name }) => name),
      ),
    );
  }

  /** What one user saw is not shown to the next. */
  #forget(): void {
    this.#abortAll(t('signed out'));
    this.user.set(null);
    this.vehicles.set(new Map());
    this.lostControls.clear();
    this.assist.clear();
    this.operations.clear();
    this.parameterTables.clear();
    this.recordings.clear();
    this.deafSinceMs.set(null);
    this.journal.clear();
    this.alerts.clear();
    this.separations.clear();
  }
}
