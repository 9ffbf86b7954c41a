/** The commands of a pilot, with a question before each dangerous one. For buttons, keys and pads alike. */

import { confirmArming } from './arming';
import { ask, FALLS_S } from './confirmation.svelte';
import { land, returnHome } from './flight_ends';
import { t } from './languages/text';
import type { FlightValues } from './link/flight_values';
import { modeSetOf, type Mode } from './link/modes';
import { wrapped, type Place, type Target } from './link/messages';
import type { Outcome } from './link/outcome';
import type { Vehicle } from './link/vehicle';
import { preferences } from './preferences.svelte';
import { latLon } from './words/format';
import { measured, type Quantity } from './words/units';

const NO_PLACE: Outcome = { kind: 'failed', why: t('its position is unknown') };
const NO_HOME: Outcome = { kind: 'failed', why: t('it has no home yet, so the height of home is unknown') };

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
    const text = t('The motors of {name} will start to turn. Is everybody clear of it?', { name: this.#name });
    const agreed = await confirmArming(this.#vehicle, {
      title: t('Arm {name}?', { name: this.#name }),
      text,
      confirmLabel: t('Arm'),
    });
    if (agreed) await this.#vehicle.command(t('Arm'), { command: 'arm' }, agreed);
  }

  async disarm(): Promise<void> {
    const name = this.#name;
    const { airborne } = this.#values();
    if (airborne === false) {
      const text = t('The motors of {name} will stop.', { name });
      if (await ask({ title: t('Disarm {name}?', { name }), text, confirmLabel: t('Disarm') })) {
        await this.#vehicle.command(t('Disarm'), { command: 'disarm' });
      }
      return;
    }
    const agreed = await ask({
      title: t('Stop the motors of {name} in flight?', { name }),
      text:
        airborne === null
          ? t('It is not known whether {name} is in the air. If it is, it falls.', { name })
          : t('{name} falls to the ground from {high}, and nothing can stop it then.', {
              name,
              high: high(this.#values().altRelM),
            }),
      confirmLabel: t('Let {name} fall', { name }),
      isDanger: true,
      heldS: FALLS_S,
    });
    if (agreed) await this.#vehicle.command(t('Disarm in flight'), { command: 'disarm', force: true });
  }

  takeOffWords(heightM: number): string {
    return t('Take off with {name} to {high}', { name: this.#name, high: high(heightM) });
  }

  /** `isHeld`: the button was held for a second, which answers the question; a danger that was not read asks still. */
  async takeOff(heightM: number, { isHeld = false } = {}): Promise<void> {
    const name = this.#name;
    const isArmed = this.#values().armed === true;
    const arming = isArmed ? '' : ` ${t('arms its motors')}`;
    const text = t('{name}{what} climbs to {high} above home. Is everybody clear of it?', {
      name,
      what: arming ? t('{arming} and', { arming }) : '',
      high: high(heightM),
    });
    const question = { title: `${this.takeOffWords(heightM)}?`, text, confirmLabel: t('Take off') };
    const label = t('Take off to {high}', { high: high(heightM) });
    const command = { command: 'takeoff', height_m: heightM } as const;
    if (isArmed) {
      if (isHeld || (await ask(question))) await this.#vehicle.command(label, command);
      return;
    }
    const agreed = await confirmArming(this.#vehicle, question, { isAnswered: isHeld });
    if (agreed) await this.#vehicle.command(label, command, agreed);
  }

  returnHome(): Promise<void> {
    return returnHome(this.#vehicle);
  }

  land(): Promise<void> {
    return land(this.#vehicle);
  }

  /** Never asks: it is the remedy when something else goes wrong. */
  async hold(): Promise<void> {
    await this.#vehicle.sendHold();
  }

  /** Does not ask on the ground with motors stopped, because it is harmless. */
  async changeMode(modeName: string): Promise<void> {
    const { autopilot, vehicleType, mode: before, armed } = this.#values();
    const mode =
      autopilot === null ? undefined : modeSetOf(autopilot, vehicleType)?.modes.find(({ name }) => name === modeName);
    if (!mode) return;
    const warning = this.#warningOf(mode);
    const text = t('{name} changes from {before} to {mode} at once.{warning}', {
      name: this.#name,
      before: before ?? t('its mode'),
      mode: mode.name,
      warning,
    });
    const title = t('Change the mode of {name}?', { name: this.#name });
    const question = {
      title,
      text,
      confirmLabel: t('Change to {mode}', { mode: mode.name }),
      isDanger: warning !== '',
    };
    if (armed !== false && !(await ask(question))) return;
    await this.#vehicle.command(t('Mode {mode}', { mode: mode.name }), { command: 'mode', mode: mode.name });
  }

  #warningOf(mode: Mode): string {
    const isUnflown =
      mode.obeysSticks && this.#values().airborne !== false && this.#vehicle.manual.state.get().phase !== 'flying';
    return isUnflown
      ? ` ${t('This mode follows the sticks, and this page sends none. With the radio at rest it sinks to the ground.')}`
      : '';
  }

  /** Never asks: Hold ends it. What it will do stands in the menu of the place (parts/MapMenu.svelte). */
  async goTo(target: Target): Promise<void> {
    await this.#goTo(t('Go to {latLon} at {high}', { latLon: latLon(target), high: high(target.altRelM) }), target);
  }

  /** Never asks, like speed and turn: Hold ends it. What it will do stands beside the number (`previewOf`). */
  async changeHeight(altRelM: number): Promise<void> {
    await this.#changeHeight(t('Height {high}', { high: high(altRelM) }), altRelM);
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

  async changeSpeed(speedMps: number): Promise<void> {
    await this.#vehicle.command(t('Speed {fast}', { fast: fast(speedMps) }), { command: 'speed', m_s: speedMps });
  }

  async turnTo(headingDeg: number): Promise<void> {
    await this.#vehicle.command(t('Turn to {heading}°', { heading: headingDeg }), { command: 'yaw', deg: headingDeg });
  }

  /** What Enter will do, while a number is typed. */
  heightPreview(altRelM: number): string {
    const name = this.#name;
    const now = this.#values().altRelM;
    const to = { name, high: high(altRelM), now: words('height', now) };
    if (now === null) return t('Enter: {name} goes to {high} above home', to);
    return altRelM >= now
      ? t('Enter: {name} climbs from {now} to {high} above home', to)
      : t('Enter: {name} descends from {now} to {high} above home', to);
  }

  speedPreview(speedMps: number): string {
    return t('Enter: {name} flies at {fast} over the ground', { name: this.#name, fast: fast(speedMps) });
  }

  headingPreview(headingDeg: number): string {
    return t('Enter: {name} turns to {heading}° where it is', { name: this.#name, heading: headingDeg });
  }

  /** Null: the drone's current position. */
  async setHome(place: Place | null): Promise<void> {
    const name = this.#name;
    const isOnGround = this.#values().airborne === false;
    const height = place || !isOnGround ? t(', as high as its home was') : '';
    const where = `${place ? t('at {latLon}', { latLon: latLon(place) }) : t('where it is now')}${height}`;
    const text = t(
      '{name} returns to this place from now on, also by itself when it loses tower or pilot. Home is {where}.',
      { name, where },
    );
    if (!(await ask({ title: t('Set the home of {name}?', { name }), text, confirmLabel: t('Set home') }))) return;
    const label = place ? t('Home at {latLon}', { latLon: latLon(place) }) : t('Home here');
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
