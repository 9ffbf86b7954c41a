/**
 * What a pilot can command through the tower: circles, points of interest, the mission on board. Asks as
 * pilot_actions.ts does.
 */

import { confirmArming } from './arming';
import { ask, LEAVES_OR_ENDS_S } from './confirmation.svelte';
import { t } from './languages/text';
import { begunOrEnded, followLeader, landAt, type DroneCommand, type LandAtCommand } from './link/drone_commands';
import type { FlightValues } from './link/flight_values';
import { wrapped, type Target } from './link/messages';
import type { Operation } from './link/operation_types';
import type { Outcome } from './link/outcome';
import { isOver, type Operations } from './link/operations';
import type { Schemas } from './link/rest_types';
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
const number = (item: number): string => t('item {item}', { item: item + 1 });

type StartOrJump = Schemas['Start'] | Schemas['Jump'];

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

  /** Never asks, like a go-to: Hold ends it. */
  async orbit({ latDeg, lonDeg, altRelM, radiusM, isClockwise, speedMps }: Circle): Promise<void> {
    await this.#command(
      t('Circle of {far} round {latLon} at {altRel}', {
        far: far(radiusM),
        latLon: latLon({ latDeg, lonDeg }),
        altRel: metres(altRelM),
      }),
      {
        command: 'orbit',
        lat: latDeg,
        lon: lonDeg,
        height_m: altRelM,
        radius_m: isClockwise ? radiusM : -radiusM,
        ...(speedMps === null ? {} : { m_s: speedMps }),
      },
    );
  }

  landThereWords(target: Target): string {
    const [where, high] = [latLon(target), metres(target.altRelM)];
    return t('{name} flies to {where} at {high}, then lands there.', { name: this.#name, where, high });
  }

  /** Ends the flight: held for a second (docs/console.md), by the menu's button (`isHeld`) or by that of the question. */
  async landThere(target: Target, { isHeld = false } = {}): Promise<void> {
    const { id, name } = this.#vehicle.drone.get();
    const words = this.landThereWords(target);
    const question = { title: t('Have {name} land there?', { name }), text: words, confirmLabel: t('Land there') };
    if (!isHeld && !(await ask({ ...question, heldS: LEAVES_OR_ENDS_S }))) return;
    const { latDeg, lonDeg, altRelM } = target;
    const command: LandAtCommand = { command: 'land_at', lat: latDeg, lon: wrapped(lonDeg), height_m: altRelM };
    const begin = async (): Promise<Outcome> => {
      try {
        const begun = await landAt(this.#operations, id, command);
        const now = await begunOrEnded(this.#operations, begun.id);
        const isUnderWay = now !== null && !isOver(now);
        return {
          kind: 'reported',
          isDone: isUnderWay || now?.state === 'done',
          words: isUnderWay ? words : now?.words || '',
        };
      } catch (error) {
        return { kind: 'reported', isDone: false, words: error instanceof Error ? error.message : String(error) };
      }
    };
    await this.#vehicle.perform(t('Land there'), () => this.#vehicle.target.follow(command, begin()));
  }

  /** Never asks: only the camera, or the nose, moves. */
  async lookAt({ latDeg, lonDeg, altRelM }: Target): Promise<void> {
    const command = { command: 'roi', lat: latDeg, lon: lonDeg, height_m: altRelM } as const;
    await this.#command(t('Look at {latLon}', { latLon: latLon({ latDeg, lonDeg }) }), command);
  }

  /** Does not ask: only the camera moves. */
  async lookAhead(): Promise<void> {
    await this.#command(t('Look ahead'), { command: 'roi', none: true });
  }

  /** The report says when the drone follows; parts/FollowStrip.svelte shows its progress and end. */
  async follow(leader: { readonly id: number; readonly name: string }, place: FollowPlace): Promise<void> {
    const name = this.#name;
    const where = placeWords(place, leader.name, preferences.units);
    const text = t(
      '{name} leaves what it does, flies in a straight line to {where}, and keeps that place wherever {leader} flies. The place does not turn with {leader}. {end}',
      { name, where, leader: leader.name, end: endWords(leader.name, preferences.units) },
    );
    if (
      !(await ask({
        title: t('Have {name} follow {leader}?', { name, leader: leader.name }),
        text,
        confirmLabel: t('Follow'),
      }))
    )
      return;
    const { id } = this.#vehicle.drone.get();
    const { northM, eastM, upM } = place;
    const command = { command: 'follow', leader: leader.id, north_m: northM, east_m: eastM, up_m: upM } as const;
    await this.#vehicle.perform(t('Follow {leader}', { leader: leader.name }), async () => {
      try {
        const begun = await followLeader(this.#operations, id, { ...command, for_s: FOLLOW_FOR_S });
        const now = await begunOrEnded(this.#operations, begun.id);
        const words = now === null || isOver(now) ? now?.words : t('{name} flies to {where}.', { name, where });
        return { kind: 'reported', isDone: now !== null && !isOver(now), words: words || t('It ended at once.') };
      } catch (error) {
        return { kind: 'reported', isDone: false, words: error instanceof Error ? error.message : String(error) };
      }
    });
  }

  /** Never asks: the drone holds. */
  async stopFollowing({ id }: Operation): Promise<void> {
    await this.#vehicle.perform(t('Stop following'), async () => {
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
    const from = item === 0 ? '' : ` ${t('from {number} on', { number: number(item) })}`;
    const title = t('Start the mission of {name}?', { name });
    const { airborne, armed } = this.#values();
    const label = t('Start the mission{from}', { from });
    const command = { command: 'start', item } as const;
    if (airborne) {
      const text = t('{name} stops what it is doing and flies its mission of {count} items{from}.', {
        name,
        count,
        from,
      });
      if (await ask({ title, text, confirmLabel: t('Start') })) await this.#flyFrom(label, command);
      return;
    }
    const arming =
      armed === true ? '' : armed === null ? ` ${t('arms its motors if they are off,')}` : ` ${t('arms its motors,')}`;
    const text = t('{name}{arming} takes off and flies its mission of {count} items{from}. Is everybody clear of it?', {
      name,
      arming,
      count,
      from,
    });
    const agreed = await confirmArming(this.#vehicle, { title, text, confirmLabel: t('Start') });
    if (agreed) await this.#flyFrom(label, command, agreed);
  }

  /** What earlier items have set and nobody sets again is somebody's choice. */
  async #flyFrom(label: string, command: StartOrJump, before?: () => Promise<void>): Promise<void> {
    const outcome = await this.#vehicle.command(label, command, before);
    if (outcome.kind !== 'reported' || outcome.problem !== 'state-not-restored') return;
    const title = t('Fly the mission of {name} as it is?', { name: this.#name });
    if (await ask({ title, text: outcome.words, confirmLabel: t('Fly as it is') }))
      await this.#command(label, { ...command, as_it_is: true });
  }

  /** Never asks: the drone stops in place. */
  async pauseMission(): Promise<void> {
    await this.#command(t('Pause the mission'), { command: 'pause' });
  }

  async resumeMission(): Promise<void> {
    const text = t('{name} goes on with its mission from where it is.', { name: this.#name });
    if (
      await ask({ title: t('Resume the mission of {name}?', { name: this.#name }), text, confirmLabel: t('Resume') })
    ) {
      await this.#command(t('Resume the mission'), { command: 'resume' });
    }
  }

  async jumpTo(item: number, words: string): Promise<void> {
    const name = this.#name;
    const text = t('{name} goes on with {number} ({words}), and skips what is between.', {
      name,
      number: number(item),
      words,
    });
    if (
      await ask({ title: t('Send {name} to {number}?', { name, number: number(item) }), text, confirmLabel: t('Jump') })
    ) {
      await this.#flyFrom(t('Jump to {number}', { number: number(item) }), { command: 'jump', item });
    }
  }
}
