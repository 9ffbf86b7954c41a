/** What a pilot can command of the payload. Asks before what can do harm, and names the drone (as pilot_actions.ts). */

import { ask } from './confirmation.svelte';
import { t } from './languages/text';
import type { DroneCommand } from './link/drone_commands';
import type { Vehicle } from './link/vehicle';

export const SERVO_MIN_US = 500;
export const SERVO_MAX_US = 2500;

type Zoom = 'in' | 'out' | 'stop';

export class PayloadActions {
  readonly #vehicle: Vehicle;

  constructor(vehicle: Vehicle) {
    this.#vehicle = vehicle;
  }

  get #name(): string {
    return this.#vehicle.drone.get().name;
  }

  async #command(label: string, command: DroneCommand): Promise<void> {
    await this.#vehicle.command(label, command);
  }

  /** Does not ask: only the camera moves. */
  async point(pitchDeg: number, yawDeg: number): Promise<void> {
    const command = { command: 'gimbal', pitch_deg: pitchDeg, yaw_deg: yawDeg } as const;
    await this.#command(t('Point the camera to {pitch}°, {yaw}°', { pitch: pitchDeg, yaw: yawDeg }), command);
  }

  async zoom(camera: number, direction: Zoom): Promise<void> {
    const label = { stop: t('Stop the zoom'), in: t('Zoom in'), out: t('Zoom out') }[direction];
    await this.#command(label, { command: 'zoom', direction, camera });
  }

  async photo(camera: number): Promise<void> {
    await this.#command(t('Take a photograph'), { command: 'photo', camera });
  }

  async record(camera: number, on: boolean): Promise<void> {
    await this.#command(on ? t('Record on board') : t('End the recording'), { command: 'record', on, camera });
  }

  /** Does not ask: a closed gripper drops nothing. */
  async grab(): Promise<void> {
    await this.#command(t('Grab the load'), { command: 'gripper', action: 'grab' });
  }

  async release(airborne: boolean | null): Promise<void> {
    const name = this.#name;
    const falls =
      airborne === false ? t('It lets go of its load.') : t('It is in the air: its load falls to the ground.');
    const text = t('{name} opens its gripper. {falls} Is everybody clear of it?', { name, falls });
    if (
      await ask({ title: t('Release the load of {name}?', { name }), text, confirmLabel: t('Release'), isDanger: true })
    ) {
      await this.#command(t('Release the load'), { command: 'gripper', action: 'release' });
    }
  }

  async servo(number: number, pulseUs: number): Promise<void> {
    const name = this.#name;
    const text = t('{name} moves servo {number} to {pulseUs} µs. Whatever it holds or drives may fall or move.', {
      name,
      number,
      pulseUs,
    });
    if (
      await ask({
        title: t('Move servo {number} of {name}?', { number, name }),
        text,
        confirmLabel: t('Move'),
        isDanger: true,
      })
    ) {
      await this.#command(t('Move servo {number}', { number }), { command: 'servo', servo: number, pulse_us: pulseUs });
    }
  }
}
