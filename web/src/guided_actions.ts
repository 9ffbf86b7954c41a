/**
 * What a pilot can command through the tower: circles, points of interest, the mission on board. Asks as
 * pilot_actions.ts does.
 */

import { confirmArming } from './arming';
import { ask } from './confirmation.svelte';
import { followLeader, followsOrEnded, type DroneCommand } from './link/drone_commands';
import type { FlightValues } from './link/flight_values';
import type { Target } from './link/messages';
import type { Operation } from './link/operation_types';
import { isOver, type Operations } from './link/operations';
import type { Vehicle } from './link/vehicle';
import { preferences } from './preferences.svelte';
import { endWords, FOLLOW_FOR_S, placeWords, type FollowPlace } from './squad/follow_place';
import { latLon } from './words/format';
import { measured } from './words/units';

export interface Circle extends Target {
  /** The radius around the centre; the drone circles at `altRelM`. */
  readonly radiusM: number;
  readonly isClockwise: boolean;
  /** Null: the autopilot's default speed. */
  readonly speedMps: number | null;
}

const metres = (value: number): string => measured(preferences.units, 'height', value, Number.isInteger(value) ? 0 : 1);
const far = (value: number): string => measured(preferences.units, 'distance', value);
/** Counted from 1 for display. */
const number = (item: number): string => `item ${item + 1}`;

export class GuidedActions {
  readonly #vehicle: Vehicle;
  readonly #operations: Operations;
  readonly #values: () => FlightValues;

  constructor(vehicle: Vehicle, operations: Operations, values: () => FlightValues) {
    this.#vehicle = vehicle;
    this.#operations = operations;
    this.#values = values;
  }

  get #name(): string {
    return this.#vehicle.drone.get().name;
  }

  async #command(label: string, command: DroneCommand): Promise<void> {
    await this.#vehicle.command(label, command);
  }

  /** The dialog that set place and radius has asked already. */
  async orbit({ latDeg, lonDeg, altRelM, radiusM, isClockwise, speedMps }: Circle): Promise<void> {
    await this.#command(`Circle of ${far(radiusM)} round ${latLon({ latDeg, lonDeg })} at ${metres(altRelM)}`, {
      command: 'orbit',
      lat: latDeg,
      lon: lonDeg,
      height_m: altRelM,
      radius_m: isClockwise ? radiusM : -radiusM,
      ...(speedMps === null ? {} : { m_s: speedMps }),
    });
  }

  /** The dialog that set the place has asked already. */
  async lookAt({ latDeg, lonDeg, altRelM }: Target): Promise<void> {
    const command = { command: 'roi', lat: latDeg, lon: lonDeg, height_m: altRelM } as const;
    await this.#command(`Look at ${latLon({ latDeg, lonDeg })}`, command);
  }

  /** Does not ask: only the camera moves. */
  async lookAhead(): Promise<void> {
    await this.#command('Look ahead', { command: 'roi', none: true });
  }

  /** The report says when the drone follows; parts/FollowStrip.svelte shows its progress and end. */
  async follow(leader: { readonly id: number; readonly name: string }, place: FollowPlace): Promise<void> {
    const name = this.#name;
    const where = placeWords(place, leader.name, preferences.units);
    const text =
      `${name} leaves what it does, flies in a straight line to ${where}, and keeps that place wherever ${leader.name} ` +
      `flies. The place does not turn with ${leader.name}. ${endWords(leader.name, preferences.units)}`;
    if (!(await ask({ title: `Have ${name} follow ${leader.name}?`, text, confirmLabel: 'Follow' }))) return;
    const { id } = this.#vehicle.drone.get();
    const { northM, eastM, upM } = place;
    const command = { command: 'follow', leader: leader.id, north_m: northM, east_m: eastM, up_m: upM } as const;
    await this.#vehicle.perform(`Follow ${leader.name}`, async () => {
      try {
        const begun = await followLeader(this.#operations, id, { ...command, for_s: FOLLOW_FOR_S });
        const now = await followsOrEnded(this.#operations, begun.id);
        const words = now === null || isOver(now) ? now?.words : `${name} flies to ${where}.`;
        return { kind: 'reported', isDone: now !== null && !isOver(now), words: words || 'It ended at once.' };
      } catch (error) {
        return { kind: 'reported', isDone: false, words: error instanceof Error ? error.message : String(error) };
      }
    });
  }

  /** Never asks: the drone holds. */
  async stopFollowing({ id }: Operation): Promise<void> {
    await this.#vehicle.perform('Stop following', async () => {
      try {
        await this.#operations.cancel(id);
        const { state, words } = await this.#operations.ended(id);
        return { kind: 'reported', isDone: state === 'cancelled', words };
      } catch (error) {
        return { kind: 'reported', isDone: false, words: error instanceof Error ? error.message : String(error) };
      }
    });
  }

  /** From the ground the drone takes off, and arms first if necessary. */
  async startMission(item: number, count: number): Promise<void> {
    const name = this.#name;
    const from = item === 0 ? '' : ` from ${number(item)} on`;
    const title = `Start the mission of ${name}?`;
    const { airborne, armed } = this.#values();
    const label = `Start the mission${from}`;
    const command = { command: 'start', item } as const;
    if (airborne) {
      const text = `${name} stops what it is doing and flies its mission of ${count} items${from}.`;
      if (await ask({ title, text, confirmLabel: 'Start' })) await this.#command(label, command);
      return;
    }
    const arming = armed === true ? '' : armed === null ? ' arms its motors if they are off,' : ' arms its motors,';
    const text = `${name}${arming} takes off and flies its mission of ${count} items${from}. Is everybody clear of it?`;
    const agreed = await confirmArming(this.#vehicle, { title, text, confirmLabel: 'Start' });
    if (agreed) await this.#vehicle.command(label, command, agreed);
  }

  /** Never asks: the drone stops in place. */
  async pauseMission(): Promise<void> {
    await this.#command('Pause the mission', { command: 'pause' });
  }

  async resumeMission(): Promise<void> {
    const text = `${this.#name} goes on with its mission from where it is.`;
    if (await ask({ title: `Resume the mission of ${this.#name}?`, text, confirmLabel: 'Resume' })) {
      await this.#command('Resume the mission', { command: 'resume' });
    }
  }

  async jumpTo(item: number, words: string): Promise<void> {
    const name = this.#name;
    const text = `${name} goes on with ${number(item)} (${words}), and skips what is between.`;
    if (await ask({ title: `Send ${name} to ${number(item)}?`, text, confirmLabel: 'Jump' })) {
      await this.#command(`Jump to ${number(item)}`, { command: 'jump', item });
    }
  }
}
