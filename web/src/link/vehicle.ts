/** Everything that the console knows about one drone and can do with it. */

import { t } from '../languages/text';
import type { Alert } from './alerts';
import { BatteryMeter } from './battery_time';
import type { Clock } from './clock';
import type { DroneCommand } from './drone_commands';
import { flightValues, type FlightValues, type HeardByTower } from './flight_values';
import { eitherSays } from './drone_view';
import { GoToTarget } from './go_to_target';
import { HoldFrame } from './hold_frame';
import type { HoldLog } from './hold_log';
import { readHold, type HoldReading } from './hold_view';
import { lastHeard, type Silence } from './loss_countdown';
import { severityOf, type Entry } from './journal';
import type { Sending } from './live';
import { Manual, manualControlFields } from './manual';
import { encode } from './mavlink';
import type { MessageFields } from './generated/mavlink.gen';
import { AUTOPILOT_COMPID, CONSOLE } from './messages';
import { isMissionFlown, MissionProgress } from './mission_progress';
import { missionPhase, type MissionPhase } from './mission_moves';
import { isGood, outcomeWords, type Outcome } from './outcome';
import type { ParametersKnown, PlanKind, PlanOnBoard } from './operation_types';
import type { Rehearsal } from './rehearsal_log';
import type { LossCheck } from './safety_types';
import { StatusTextAssembler } from './status_texts';
import type { Axes } from './sticks';
import { Store } from './store';
import { tag } from './tagged_frames';
import { Telemetry } from './telemetry';
import { troubleOf, type Trouble } from './trouble';
import type { Drone, LinkQuality } from './wire_types';

/** Autopilot statements within this time after an answer still belong to the action (arming: "PreArm: ..."). */
export const REASON_WINDOW_MS = 2_000;

/** The tower notices a silence a few seconds after the last frame. */
const SAME_MOMENT_MS = 10_000;

/** What the tower has of the drone: the live channel for frames, operations for commands, alerts. */
export interface Uplink {
  /** Resolves to the outcome. Never rejects. */
  command(droneId: number, command: DroneCommand): Promise<Outcome>;
  send(message: Uint8Array<ArrayBuffer>): boolean;
  sendFresh(message: Uint8Array<ArrayBuffer>): Sending;
  /** The open alerts of the drone, the most urgent first. */
  alerts(droneId: number): readonly Alert[];
}

export interface Action {
  readonly key: number;
  readonly label: string;
  readonly beganMs: number;
  readonly endedMs: number | null;
  readonly outcome: Outcome | null;
  readonly text: string;
}

export class Vehicle {
  readonly telemetry = new Telemetry();
  readonly drone: Store<Drone>;
  readonly action = new Store<Action | null>(null);
  readonly holdLog = new Store<HoldLog | null>(null);
  readonly rehearsal = new Store<Rehearsal | null>(null);
  readonly lossCheck = new Store<LossCheck | null>(null);
  /** What is on board; a missing kind has not been reported. */
  readonly plans = new Store<Readonly<Partial<Record<PlanKind, PlanOnBoard>>>>({});
  readonly parameters = new Store<ParametersKnown | null>(null);
  readonly mission = new MissionProgress();
  link: LinkQuality | null = null;
  /** Take-off as seen by this page, on the link clock; null while not flying. */
  #airborneSeenMs: number | null = null;
  /** Take-off as reported by the tower, on the link clock: a page opened in mid-flight does not start from zero. */
  #airborneReportedMs: number | null = null;
  /** Since when the tower does not hear from it; null while it does, and if nobody knows. */
  silentSinceMs: number | null = null;
  /** In the air at the last report; null: never reported. */
  wasAirborne: boolean | null = null;
  /** Our clock minus the tower's time of day. */
  towerLagMs = 0;
  /** Since when its hold is open; null: none, or it was open before this page. */
  holdSinceMs: number | null = null;
  /** Since when it is in its mode; null: since before this page. */
  modeSinceMs: number | null = null;

  #lastHeard: HeardByTower | null = null;

  readonly #clock: Clock;
  readonly #uplink: Uplink;
  readonly #record: (entry: Entry) => void;
  readonly #battery = new BatteryMeter();
  readonly #texts = new StatusTextAssembler();
  readonly #hold: HoldFrame;
  readonly target: GoToTarget;
  readonly manual: Manual;
  readonly #frameListeners = new Set<(frame: Uint8Array, nowMs: number) => void>();
  #seq = 0;
  #actions = 0;

  constructor(drone: Drone, clock: Clock, uplink: Uplink, record: (entry: Entry) => void, beatClock = clock) {
    this.drone = new Store(drone);
    this.#clock = clock;
    this.#uplink = uplink;
    this.#record = record;
    this.#hold = new HoldFrame(clock, this.telemetry, (fields) => this.#transmit(fields));
    this.target = new GoToTarget(this.telemetry);
    this.manual = new Manual({
      clock: beatClock,
      send: (axes) => this.#sendSticks(axes),
      hold: () => void this.sendHold(),
    });
    this.wasAirborne = lastSaid(drone);
  }

  /** The tower's newest view of it. `towerLagMs`: our clock minus the tower's time of day. */
  put(drone: Drone, nowMs: number, towerLagMs = 0): void {
    const sinceMs = drone.airborne_since === null ? NaN : Date.parse(drone.airborne_since) + towerLagMs;
    this.#airborneReportedMs = Number.isFinite(sinceMs) ? Math.min(sinceMs, nowMs) : null;
    const lastHeardMs = drone.last_heard ? Date.parse(drone.last_heard.at) + towerLagMs : NaN;
    this.#lastHeard =
      drone.last_heard && Number.isFinite(lastHeardMs)
        ? { view: drone.last_heard, atMs: Math.min(lastHeardMs, nowMs) }
        : null;
    if (drone.online) this.silentSinceMs = null;
    else if (this.#lastHeard) this.silentSinceMs = this.#lastHeard.atMs;
    else if (this.drone.get().online) this.silentSinceMs = nowMs;
    this.towerLagMs = towerLagMs;
    const isAirborne = drone.online ? this.isAirborne(drone, nowMs) : null;
    this.wasAirborne = isAirborne ?? drone.last_heard?.airborne ?? this.wasAirborne;
    if (drone.hold?.open !== true) this.holdSinceMs = null;
    else if (this.drone.get().hold?.open !== true) this.holdSinceMs = nowMs;
    for (const plan of Object.values(drone.plans ?? {})) this.onBoard(plan);
    if (drone.parameters !== undefined) this.parameters.set(drone.parameters);
    this.drone.set(drone);
  }

  onBoard(plan: PlanOnBoard): void {
    this.plans.update((plans) => ({ ...plans, [plan.kind]: plan }));
    if (plan.kind === 'mission') this.mission.onBoard(plan.hash);
  }

  /** Combines the reports of the agent and the autopilot: true if either says so; null if neither knows. */
  isAirborne(drone: Drone, nowMs: number): boolean | null {
    return eitherSays(drone.airborne, this.values(nowMs).airborne);
  }

  /** Its open hold and its lost action; null: nothing to report. */
  hold(nowMs: number): HoldReading | null {
    const { name: droneName, lost_action_s: lostActionS, hold } = this.drone.get();
    return readHold(hold, { droneName, lostActionS, towerLagMs: this.towerLagMs }, nowMs);
  }

  /** What is wrong with it, by the tower's alerts; null: nothing. */
  trouble(): Trouble | null {
    return troubleOf(this.#uplink.alerts(this.drone.get().id));
  }

  /** While the tower does not hear it, or this page does not hear the tower (`deafSinceMs`): what it did last. */
  silence(deafSinceMs: number | null, nowMs: number): Silence | null {
    const drone = this.drone.get();
    const sinceMs = deafSinceMs ?? (drone.online ? null : this.silentSinceMs);
    if (sinceMs === null) return null;
    const values = this.values(nowMs);
    // A drone that this page has never received data from.
    if (this.wasAirborne === null && values.heartbeatAgeMs === null) return null;
    const whose = deafSinceMs === null ? 'drone' : 'own';
    return { ...lastHeard(drone, values, this.wasAirborne), whose, sinceMs, towerLagMs: this.towerLagMs };
  }

  missionPhase(values: FlightValues): MissionPhase {
    const board = this.plans.get().mission;
    return missionPhase({
      count: board === undefined || board.hash === null ? null : board.count,
      airborne: eitherSays(values.airborne, this.drone.get().airborne),
      isFlown: isMissionFlown(values),
      task: values.task,
      missionState: this.telemetry.newest('MISSION_CURRENT')?.fields.mission_state ?? null,
      wasPaused: this.mission.wasPaused,
    });
  }

  /** Calls back with each frame as it comes, decoded or not. Good until the callback returns: keep a copy. */
  onFrame(listener: (frame: Uint8Array, nowMs: number) => void): () => void {
    this.#frameListeners.add(listener);
    return () => this.#frameListeners.delete(listener);
  }

  receive(frame: Uint8Array, nowMs: number): void {
    for (const listener of this.#frameListeners) listener(frame, nowMs);
    const modeBefore = this.telemetry.newest('HEARTBEAT')?.fields.custom_mode;
    const message = this.telemetry.receive(frame, nowMs);
    if (!message) return;
    if (message.name === 'HEARTBEAT' && this.telemetry.isFromAutopilot(message)) {
      if (modeBefore !== undefined && message.fields.custom_mode !== modeBefore) this.modeSinceMs = nowMs;
    }
    if (this.telemetry.isFromAutopilot(message)) {
      this.mission.receive(message, this.telemetry.newest('HEARTBEAT')?.fields.autopilot ?? null);
    }
    if (message.name === 'STATUSTEXT') {
      const entry = this.#texts.receive(message.header, message.fields, nowMs);
      this.#record({
        key: `text-${this.drone.get().id}-${entry.key}`,
        atMs: entry.atMs,
        droneId: this.drone.get().id,
        source: 'autopilot',
        severity: severityOf(entry.severity),
        text: entry.text,
      });
    } else if (message.name === 'SYS_STATUS' && this.telemetry.isFromAutopilot(message)) {
      if (message.fields.battery_remaining >= 0) this.#battery.percentage(message.fields.battery_remaining, nowMs);
    } else if (message.name === 'BATTERY_STATUS' && this.telemetry.isFromAutopilot(message)) {
      this.#battery.charge(message.fields.id, message.fields.charge_state);
      if (message.fields.id === 0) this.#battery.said(message.fields.time_remaining, nowMs);
    } else if (message.name === 'HEARTBEAT' || message.name === 'EXTENDED_SYS_STATE') {
      const { airborne } = this.values(nowMs);
      if (airborne === null) return;
      if (!airborne) this.#airborneSeenMs = null;
      else this.#airborneSeenMs ??= nowMs;
      this.#battery.inAir(airborne);
      this.wasAirborne = airborne || this.drone.get().airborne === true;
    }
  }

  values(nowMs: number): FlightValues {
    const { link } = this;
    const { online, armed } = this.drone.get();
    const seenMs = this.#airborneSeenMs;
    const airborneSinceMs = seenMs === null ? null : Math.min(seenMs, this.#airborneReportedMs ?? seenMs);
    const batteryTime = this.#battery.left(nowMs);
    const beside = {
      online,
      armed,
      target: this.target.now.get(),
      link,
      airborneSinceMs,
      batteryTime,
      batteryCharge: this.#battery.worstCharge,
      lastHeard: this.#unheardHere(),
    };
    return flightValues(this.telemetry, beside, nowMs);
  }

  /** What the tower heard last, unless this page heard the same. */
  #unheardHere(): HeardByTower | null {
    const last = this.#lastHeard;
    const heardMs = this.telemetry.newest('HEARTBEAT')?.atMs;
    return last && (heardMs === undefined || heardMs < last.atMs - SAME_MOMENT_MS) ? last : null;
  }

  /** Has the tower carry it out. `before`: a request to the tower that must precede it. */
  command(label: string, command: DroneCommand, before?: () => Promise<void>): Promise<Outcome> {
    return this.perform(label, async () => {
      try {
        await before?.();
      } catch (error) {
        return { kind: 'failed', why: error instanceof Error ? error.message : String(error) };
      }
      const outcome = await this.target.follow(command, this.#uplink.command(this.drone.get().id, command));
      if (command.command === 'pause' && isGood(outcome)) this.mission.wasPaused = true;
      if ((command.command === 'resume' || command.command === 'start') && isGood(outcome)) {
        this.mission.wasPaused = false;
      }
      return outcome;
    });
  }

  /** At once, and by the shortest path: see hold_frame.ts. */
  sendHold(): Promise<Outcome> {
    return this.perform(t('Hold'), () => {
      this.target.forget();
      return this.#hold.send();
    });
  }

  /** Shows this as the current action, and writes its outcome to the journal. */
  async perform(label: string, action: () => Promise<Outcome>): Promise<Outcome> {
    const key = ++this.#actions;
    const beganMs = this.#clock.nowMs();
    this.action.set({
      key,
      label,
      beganMs,
      endedMs: null,
      outcome: null,
      text: t('{label}: waiting for the answer', { label }),
    });
    const outcome = await action();
    const endedMs = this.#clock.nowMs();
    const { id, name } = this.drone.get();
    const text = `${label}: ${outcomeWords(name, outcome)}`;
    if (this.action.get()?.key === key) this.action.set({ key, label, beganMs, endedMs, outcome, text });
    const severity = isGood(outcome) ? 'info' : 'error';
    this.#record({ key: `action-${id}-${key}`, atMs: endedMs, droneId: id, source: 'command', severity, text });
    return outcome;
  }

  abort(why: string): void {
    this.#hold.abort(why);
  }

  #transmit(fields: Partial<MessageFields['COMMAND_LONG']>): boolean {
    const { sysid } = this.telemetry;
    if (sysid === null) return false;
    const target = { target_system: sysid, target_component: AUTOPILOT_COMPID };
    const frame = encode('COMMAND_LONG', { ...fields, ...target }, CONSOLE, this.#seq++);
    return this.#uplink.send(tag(this.drone.get().id, frame));
  }

  #sendSticks(axes: Axes): Sending {
    const { sysid } = this.telemetry;
    if (sysid === null) return 'down';
    const frame = encode('MANUAL_CONTROL', manualControlFields(axes, sysid), CONSOLE, this.#seq++);
    return this.#uplink.sendFresh(tag(this.drone.get().id, frame));
  }
}

/** Only an armed drone holds: one that is offline with an open hold was presumably in the air. */
const lastSaid = ({ airborne, last_heard, hold }: Drone): boolean | null =>
  airborne ?? last_heard?.airborne ?? (hold?.open === true ? true : null);
