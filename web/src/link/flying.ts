/** What a pilot asks for, as steps with answers: arm, take off, go there, hold, return, land, change mode. */

import type { Clock } from './clock';
import { REPLACED, type Commands, type Outcome } from './commands';
import { MAV_AUTOPILOT, MAV_MODE_FLAG } from './generated/mavlink.gen';
import {
  armCommand,
  changeSpeedCommand,
  disarmCommand,
  goToCommand,
  homeAtCommand,
  homeHereCommand,
  setModeCommand,
  takeOffCommand,
  turnToCommand,
  type Place,
  type Target,
} from './messages';
import { modeSetOf, type Mode, type ModeSet } from './modes';
import { Store, type Readable } from './store';
import type { Telemetry } from './telemetry';

const CONFIRM_LIMIT_MS = 3_000;

const NOT_HEARD: Outcome = { kind: 'failed', why: 'its autopilot has not been heard yet' };
const NO_PLACE: Outcome = { kind: 'failed', why: 'it has not said where it is' };
const NO_HOME: Outcome = { kind: 'failed', why: 'it has no home yet whose height could be kept' };
const NOT_KNOWN: Outcome = { kind: 'failed', why: 'this console does not know how to do that with its autopilot' };

export class Flying {
  readonly #clock: Clock;
  readonly #commands: Commands;
  readonly #telemetry: Telemetry;
  readonly #target = new Store<Target | null>(null);
  /** Counts what was asked for: a action of several steps ends where a newer one begins. */
  #actions = 0;

  constructor(clock: Clock, commands: Commands, telemetry: Telemetry) {
    this.#clock = clock;
    this.#commands = commands;
    this.#telemetry = telemetry;
    telemetry.onMessage((message) => {
      // Out of guided mode the go-to is over, whoever ended it.
      if (message.name !== 'HEARTBEAT' || !telemetry.isFromAutopilot(message)) return;
      const guided = modeSetOf(message.fields.autopilot)?.guided;
      if (guided && message.fields.custom_mode !== guided.customMode) this.#target.set(null);
    });
  }

  /** Where we have sent it, while that holds. */
  get target(): Readable<Target | null> {
    return this.#target;
  }

  arm(): Promise<Outcome> {
    this.#actions++;
    return this.#commands.run(armCommand());
  }

  /** In flight the tower wants to be asked twice; the pilot has been asked twice by then, so the second asking is ours. */
  async disarm(evenInFlight: boolean): Promise<Outcome> {
    this.#actions++;
    const first = await this.#commands.run(disarmCommand(evenInFlight));
    return evenInFlight && first.kind !== 'accepted' ? this.#commands.run(disarmCommand(true)) : first;
  }

  /** Believed when the autopilot has accepted it and its HEARTBEAT agrees. */
  setMode(mode: Mode): Promise<Outcome> {
    this.#actions++;
    return this.#changeMode(mode);
  }

  async #changeMode(mode: Mode): Promise<Outcome> {
    const answer = await this.#commands.run(setModeCommand(mode.main, mode.sub));
    if (answer.kind !== 'accepted') return answer;
    const agreed = await this.#heartbeatSays((beat) => beat.custom_mode === mode.customMode);
    return agreed ? answer : { kind: 'unconfirmed', detail: `its heartbeat does not show ${mode.name}` };
  }

  hold(): Promise<Outcome> {
    return this.#toMode((set) => set.hold);
  }

  returnHome(): Promise<Outcome> {
    return this.#toMode((set) => set.returns);
  }

  land(): Promise<Outcome> {
    return this.#toMode((set) => set.land);
  }

  /** Guided mode, armed if it is not, then up to `heightM` above home. */
  async takeOff(heightM: number): Promise<Outcome> {
    const guided = this.#modes()?.guided;
    if (!guided) return this.#telemetry.newest('HEARTBEAT') ? NOT_KNOWN : NOT_HEARD;
    const action = ++this.#actions;
    const inMode = await this.#changeMode(guided);
    if (inMode.kind !== 'accepted') return inMode;
    if (action !== this.#actions) return REPLACED;
    if (!this.#isArmed()) {
      const armed = await this.#commands.run(armCommand());
      if (armed.kind !== 'accepted') return armed;
      if (action !== this.#actions) return REPLACED;
    }
    return this.#commands.run(takeOffCommand(heightM));
  }

  async goTo(target: Target, headingDeg: number | null = null): Promise<Outcome> {
    const action = ++this.#actions;
    const answer = await this.#commands.run(goToCommand(target, headingDeg));
    if (answer.kind === 'accepted' && action === this.#actions) this.#target.set(target);
    return answer;
  }

  /** Higher or lower, where it is or on its way. */
  async changeHeight(altRelM: number): Promise<Outcome> {
    const target = this.#target.get() ?? this.#here();
    return target ? this.goTo({ ...target, altRelM }) : NO_PLACE;
  }

  changeSpeed(speedMps: number): Promise<Outcome> {
    return this.#commands.run(changeSpeedCommand(speedMps));
  }

  /** ArduPilot turns by a command of its own; PX4 as part of a go-to to where it is. */
  async turnTo(headingDeg: number): Promise<Outcome> {
    const heartbeat = this.#telemetry.newest('HEARTBEAT');
    if (!heartbeat) return NOT_HEARD;
    if (heartbeat.fields.autopilot !== MAV_AUTOPILOT.PX4) return this.#commands.run(turnToCommand(headingDeg));
    const here = this.#target.get() ?? this.#here();
    return here ? this.goTo(here, headingDeg) : NO_PLACE;
  }

  /** In the air as high as the present home: the autopilot would lift it to where it is, and all heights above it. */
  homeHere(isOnGround: boolean): Promise<Outcome> {
    if (isOnGround) return this.#commands.run(homeHereCommand());
    const here = this.#here();
    return here ? this.homeAt(here) : Promise.resolve(NO_HOME);
  }

  /** As high as the present home: a map says nothing about heights. */
  homeAt(place: Place): Promise<Outcome> {
    const home = this.#telemetry.newest('HOME_POSITION');
    return home ? this.#commands.run(homeAtCommand(place, home.fields.altitude / 1000)) : Promise.resolve(NO_HOME);
  }

  #here(): Target | null {
    const at = this.#telemetry.newest('GLOBAL_POSITION_INT')?.fields;
    if (!at || (at.lat === 0 && at.lon === 0)) return null;
    return { latDeg: at.lat / 1e7, lonDeg: at.lon / 1e7, altRelM: at.relative_alt / 1000 };
  }

  #toMode(pick: (set: ModeSet) => Mode): Promise<Outcome> {
    const set = this.#modes();
    if (!set) return Promise.resolve(this.#telemetry.newest('HEARTBEAT') ? NOT_KNOWN : NOT_HEARD);
    return this.setMode(pick(set));
  }

  #modes(): ModeSet | null {
    const heartbeat = this.#telemetry.newest('HEARTBEAT');
    return heartbeat && modeSetOf(heartbeat.fields.autopilot);
  }

  #isArmed(): boolean {
    const heartbeat = this.#telemetry.newest('HEARTBEAT');
    return heartbeat !== null && (heartbeat.fields.base_mode & MAV_MODE_FLAG.SAFETY_ARMED) !== 0;
  }

  #heartbeatSays(agrees: (fields: { custom_mode: number; base_mode: number }) => boolean): Promise<boolean> {
    const newest = this.#telemetry.newest('HEARTBEAT');
    if (newest && agrees(newest.fields)) return Promise.resolve(true);
    return new Promise((resolve) => {
      const finish = (result: boolean): void => {
        cancel();
        stopListening();
        resolve(result);
      };
      const cancel = this.#clock.after(CONFIRM_LIMIT_MS, () => finish(false));
      const stopListening = this.#telemetry.onMessage((message) => {
        if (message.name !== 'HEARTBEAT' || !this.#telemetry.isFromAutopilot(message)) return;
        if (agrees(message.fields)) finish(true);
      });
    });
  }
}
