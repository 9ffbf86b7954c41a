/** What a pilot can command of the payload. Asks before what can do harm, and names the drone (as pilot_actions.ts). */

import { ask } from './confirmation.svelte';
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
    await this.#command(`Point the camera to ${pitchDeg}°, ${yawDeg}°`, command);
  }

  async zoom(camera: number, direction: Zoom): Promise<void> {
    const label = direction === 'stop' ? 'Stop the zoom' : `Zoom ${direction}`;
    await this.#command(label, { command: 'zoom', direction, camera });
  }

  async photo(camera: number): Promise<void> {
    await this.#command('Take a photograph', { command: 'photo', camera });
  }

  async record(camera: number, on: boolean): Promise<void> {
    await this.#command(on ? 'Record on board' : 'End the recording', { command: 'record', on, camera });
  }

  /** Does not ask: a closed gripper drops nothing. */
  async grab(): Promise<void> {
    await this.#command('Grab the load', { command: 'gripper', action: 'grab' });
  }

  async release(airborne: boolean | null): Promise<void> {
    const name = this.#name;
    const falls = airborne === false ? 'It lets go of its load.' : 'It is in the air: its load falls to the ground.';
    const text = `${name} opens its gripper. ${falls} Is everybody clear of it?`;
    if (await ask({ title: `Release the load of ${name}?`, text, confirmLabel: 'Release', isDanger: true })) {
      await this.#command('Release the load', { command: 'gripper', action: 'release' });
    }
  }

  async servo(number: number, pulseUs: number): Promise<void> {
    const name = this.#name;
    const text = `${name} moves servo ${number} to ${pulseUs} µs. Whatever it holds or drives may fall or move.`;
    if (await ask({ title: `Move servo ${number} of ${name}?`, text, confirmLabel: 'Move', isDanger: true })) {
      await this.#command(`Move servo ${number}`, { command: 'servo', servo: number, pulse_us: pulseUs });
    }
  }
}
