/** The commands of a pilot, with a question before each dangerous one. For buttons, keys and pads alike. */

import { confirmArming } from './arming';
import { ask } from './confirmation.svelte';
import type { FlightValues } from './link/flight_values';
import { modeSetOf, type Mode } from './link/modes';
import { wrapped, type Place, type Target } from './link/messages';
import type { Outcome } from './link/outcome';
import type { Vehicle } from './link/vehicle';
import { preferences } from './preferences.svelte';
import { latLon } from './words/format';
import { measured, type Quantity } from './words/units';

const NO_PLACE: Outcome = { kind: 'failed', why: 'its position is unknown' };
const NO_HOME: Outcome = { kind: 'failed', why: 'it has no home yet, so the height of home is unknown' };

const words = (quantity: Quantity, value: number | null): string =>
  measured(preferences.units, quantity, value, value !== null && Number.isInteger(value) ? 0 : undefined);
const high = (metres: number | null): string => words('height', metres);
const fast = (mps: number): string => words('speed', mps);

export class PilotActions {
  readonly #vehicle: Vehicle;
  readonly #values: () => FlightValues;

  constructor(vehicle: Vehicle, values: () => FlightValues) {
    this.#vehicle = vehicle;
    this.#values = values;
  }

  get #name(): string {
    return this.#vehicle.drone.get().name;
  }

  async arm(): Promise<void> {
    const text = `The motors of ${this.#name} will start to turn. Is everybody clear of it?`;
    const agreed = await confirmArming(this.#vehicle, { title: `Arm ${this.#name}?`, text, confirmLabel: 'Arm' });
    if (agreed) await this.#vehicle.command('Arm', { command: 'arm' }, agreed);
  }

  async disarm(): Promise<void> {
    const name = this.#name;
    const { airborne } = this.#values();
    if (airborne === false) {
      const text = `The motors of ${name} will stop.`;
      if (await ask({ title: `Disarm ${name}?`, text, confirmLabel: 'Disarm' })) {
        await this.#vehicle.command('Disarm', { command: 'disarm' });
      }
      return;
    }
    const first = await ask({
      title: `Disarm ${name} in flight?`,
      text:
        airborne === null
          ? `It is not known whether ${name} is in the air. If it is, it falls.`
          : `${name} is in the air. Without its motors it falls.`,
      confirmLabel: 'Disarm in flight',
      isDanger: true,
    });
    if (!first) return;
    const second = await ask({
      title: `Let ${name} fall?`,
      text: `Second confirmation: the motors of ${name} stop at once and it drops from ${high(this.#values().altRelM)}.`,
      confirmLabel: 'Stop the motors now',
      isDanger: true,
    });
    if (second) await this.#vehicle.command('Disarm in flight', { command: 'disarm', force: true });
  }

  takeOffWords(heightM: number): string {
    return `Take off with ${this.#name} to ${high(heightM)}`;
  }

  /** `isHeld`: the button was held for a second, which answers the question; a danger that was not read asks still. */
  async takeOff(heightM: number, { isHeld = false } = {}): Promise<void> {
    const name = this.#name;
    const isArmed = this.#values().armed === true;
    const arming = isArmed ? '' : ' arms its motors';
    const text = `${name}${arming ? `${arming} and` : ''} climbs to ${high(heightM)} above home. Is everybody clear of it?`;
    const question = { title: `${this.takeOffWords(heightM)}?`, text, confirmLabel: 'Take off' };
    const label = `Take off to ${high(heightM)}`;
    const command = { command: 'takeoff', height_m: heightM } as const;
    if (isArmed) {
      if (isHeld || (await ask(question))) await this.#vehicle.command(label, command);
      return;
    }
    const agreed = await confirmArming(this.#vehicle, question, { isAnswered: isHeld });
    if (agreed) await this.#vehicle.command(label, command, agreed);
  }

  async returnHome(): Promise<void> {
    const text = `${this.#name} flies back to its home and lands there.`;
    if (await ask({ title: `Return ${this.#name}?`, text, confirmLabel: 'Return' })) {
      await this.#vehicle.command('Return', { command: 'rtl' });
    }
  }

  async land(): Promise<void> {
    const text = `${this.#name} lands where it is now.`;
    if (await ask({ title: `Land ${this.#name} here?`, text, confirmLabel: 'Land' })) {
      await this.#vehicle.command('Land', { command: 'land' });
    }
  }

  /** Never asks: it is the remedy when something else goes wrong. */
  async hold(): Promise<void> {
    await this.#vehicle.sendHold();
  }

  /** Does not ask on the ground with motors stopped, because it is harmless. */
  async changeMode(modeName: string): Promise<void> {
    const { autopilot, mode: before, armed } = this.#values();
    const mode = autopilot === null ? undefined : modeSetOf(autopilot)?.modes.find(({ name }) => name === modeName);
    if (!mode) return;
    const warning = this.#warningOf(mode);
    const text = `${this.#name} changes from ${before ?? 'its mode'} to ${mode.name} at once.${warning}`;
    const title = `Change the mode of ${this.#name}?`;
    const question = { title, text, confirmLabel: `Change to ${mode.name}`, isDanger: warning !== '' };
    if (armed !== false && !(await ask(question))) return;
    await this.#vehicle.command(`Mode ${mode.name}`, { command: 'mode', mode: mode.name });
  }

  #warningOf(mode: Mode): string {
    const isUnflown =
      mode.obeysSticks && this.#values().airborne !== false && this.#vehicle.manual.state.get().phase !== 'flying';
    return isUnflown
      ? ' This mode follows the sticks, and this page sends none. With the radio at rest it sinks to the ground.'
      : '';
  }

  /** The dialog that corrected the place has asked already. */
  async goTo(target: Target): Promise<void> {
    await this.#goTo(`Go to ${latLon(target)} at ${high(target.altRelM)}`, target);
  }

  async changeHeight(altRelM: number): Promise<void> {
    const name = this.#name;
    const text = `${name} changes to guided mode and goes ${this.#upOrDown(altRelM)} to ${high(altRelM)} above home.`;
    if (await ask({ title: `${name} to ${high(altRelM)}?`, text, confirmLabel: 'Change height' })) {
      await this.#changeHeight(`Height ${high(altRelM)}`, altRelM);
    }
  }

  /** At its current place, or at its target. */
  async #changeHeight(label: string, altRelM: number): Promise<void> {
    const place = this.#vehicle.target.now.get() ?? this.#values().place;
    if (place) await this.#goTo(label, { ...place, altRelM });
    else await this.#vehicle.perform(label, () => Promise.resolve(NO_PLACE));
  }

  async #goTo(label: string, { latDeg, lonDeg, altRelM }: Target): Promise<void> {
    await this.#vehicle.command(label, { command: 'goto', lat: latDeg, lon: wrapped(lonDeg), height_m: altRelM });
  }

  #upOrDown(altRelM: number): string {
    return altRelM >= (this.#values().altRelM ?? 0) ? 'up' : 'down';
  }

  async changeSpeed(speedMps: number): Promise<void> {
    const text = `${this.#name} flies at ${fast(speedMps)} over the ground from now on when it flies automatically.`;
    if (await ask({ title: `${this.#name} at ${fast(speedMps)}?`, text, confirmLabel: 'Change speed' })) {
      await this.#vehicle.command(`Speed ${fast(speedMps)}`, { command: 'speed', m_s: speedMps });
    }
  }

  async turnTo(headingDeg: number): Promise<void> {
    const text = `${this.#name} turns to ${headingDeg}° where it is.`;
    if (await ask({ title: `Turn ${this.#name} to ${headingDeg}°?`, text, confirmLabel: 'Turn' })) {
      await this.#vehicle.command(`Turn to ${headingDeg}°`, { command: 'yaw', deg: headingDeg });
    }
  }

  /** Null: the drone's current position. */
  async setHome(place: Place | null): Promise<void> {
    const name = this.#name;
    const isOnGround = this.#values().airborne === false;
    const height = place || !isOnGround ? ', as high as its home was' : '';
    const where = `${place ? `at ${latLon(place)}` : 'where it is now'}${height}`;
    const text = `${name} returns to this place from now on, also by itself when it loses tower or pilot. Home is ${where}.`;
    if (!(await ask({ title: `Set the home of ${name}?`, text, confirmLabel: 'Set home' }))) return;
    const label = place ? `Home at ${latLon(place)}` : 'Home here';
    const flying = isOnGround ? {} : { while_flying: true };
    if (!place) {
      await this.#vehicle.command(label, { command: 'set_home', here: true, ...flying });
      return;
    }
    // At the height of the current home: a map has no heights.
    const home = this.#vehicle.telemetry.newest('HOME_POSITION');
    if (!home) {
      await this.#vehicle.perform(label, () => Promise.resolve(NO_HOME));
      return;
    }
    const at = { lat: place.latDeg, lon: wrapped(place.lonDeg), altitude_m: home.fields.altitude / 1000 };
    await this.#vehicle.command(label, { command: 'set_home', ...at, ...flying });
  }
}
