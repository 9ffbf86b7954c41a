/**
 * Whose commands pass while an admin assists. The tower sends `turn` events. A refusal with the code `assisted` implies
 * the same; it counts a little longer than an admin's turn lasts after the last command.
 */

import type { Clock } from './clock';
import { Store, type Readable } from './store';
import type { Drone, User, UserRef } from './wire_types';

/** The tower returns the controls 1 s after the admin's last command; a refusal may be up to a second old. */
export const REFUSAL_BELIEVED_MS = 2_000;

type Turns = ReadonlyMap<number, UserRef>;

export class AssistTurns {
  readonly #clock: Clock;
  readonly #turns = new Store<Turns>(new Map());
  readonly #forget = new Map<number, () => void>();

  constructor(clock: Clock) {
    this.#clock = clock;
  }

  get turns(): Readable<Turns> {
    return this.#turns;
  }

  /** A `turn` event of the tower. */
  turn(droneId: number, user: UserRef): void {
    this.#set(droneId, user);
  }

  /** The tower refused our command because the assistant has the turn. */
  refused(drone: Drone): void {
    if (!drone.assistant) return;
    const known = this.#turns.get().get(drone.id);
    if (known?.id === drone.assistant.id && !this.#forget.has(drone.id)) return; // the tower will report its end
    this.#set(drone.id, drone.assistant);
    this.#forget.set(
      drone.id,
      this.#clock.after(REFUSAL_BELIEVED_MS, () => this.#remove(drone.id)),
    );
  }

  /** The turns end with the assistance. */
  drone(drone: Drone): void {
    if (!drone.assistant) this.#remove(drone.id);
  }

  clear(): void {
    for (const droneId of [...this.#turns.get().keys()]) this.#remove(droneId);
  }

  #set(droneId: number, user: UserRef): void {
    this.#cancel(droneId);
    this.#turns.update((turns) => new Map(turns).set(droneId, user));
  }

  #remove(droneId: number): void {
    this.#cancel(droneId);
    if (!this.#turns.get().has(droneId)) return;
    const next = new Map(this.#turns.get());
    next.delete(droneId);
    this.#turns.set(next);
  }

  #cancel(droneId: number): void {
    this.#forget.get(droneId)?.();
    this.#forget.delete(droneId);
  }
}

/** The assistant, while the holder's commands wait for them; null for all other users. */
export function waitsFor(drone: Drone, turn: UserRef | undefined, user: Pick<User, 'id'>): UserRef | null {
  const isTheirs = turn !== undefined && drone.assistant !== null && turn.id === drone.assistant.id;
  return isTheirs && drone.holder?.id === user.id ? drone.assistant : null;
}
