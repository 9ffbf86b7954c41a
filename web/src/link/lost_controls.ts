/**
 * How this user lost the controls of a drone: to whom, when, why. Takes the tower's messages in order (a `drone`
 * message first, then the `control` event that explains it; a drone that the user may no longer see may just
 * disappear).
 */

import { t } from '../languages/text';
import { Store, type Readable } from './store';
import type { ControlEvent, Drone, User, UserRef } from './wire_types';

export type LossKind = 'taken' | 'revoked' | 'expired' | 'removed';

export interface LostControls {
  readonly kind: LossKind;
  readonly droneId: number;
  readonly droneName: string;
  readonly by: UserRef | null;
  readonly reason: string;
  /** Null if it happened before this page was opened. */
  readonly atMs: number | null;
  /** The drone is no longer in our squad. */
  readonly isGone: boolean;
}

type Losses = ReadonlyMap<number, LostControls>;

export class LostControlsLog {
  readonly #losses = new Store<Losses>(new Map());
  /** Drones that were ours until the `drone` message of this epoch. */
  readonly #leftAt = new Map<number, number>();

  get losses(): Readable<Losses> {
    return this.#losses;
  }

  /** The tower's view of a drone changed. */
  drone(before: Drone | null, after: Drone, me: User | null, nowMs: number): void {
    if (!me) return;
    if (after.holder?.id === me.id) {
      this.#leftAt.delete(after.id);
      this.dismiss(after.id);
      return;
    }
    const wasMine = before?.holder?.id === me.id;
    if (wasMine) this.#leftAt.set(after.id, after.epoch);
    if (after.taken_from?.id === me.id) {
      if (this.#losses.get().get(after.id)?.kind === 'taken') return;
      const atMs = wasMine ? nowMs : null;
      this.#put({ ...named(after), kind: 'taken', by: after.holder, reason: '', atMs, isGone: false });
    } else if (this.#losses.get().get(after.id)?.kind === 'taken') {
      // No longer shut out, and not the holder: the claim was given up or has expired.
      this.dismiss(after.id);
    }
  }

  /** After a reconnection: the event that explains the change was missed. */
  unexplained(drone: Drone, nowMs: number): void {
    if (!this.#leftAt.delete(drone.id) || this.#losses.get().has(drone.id)) return;
    const reason = t('while this page was not connected to the tower');
    this.#put({ ...named(drone), kind: 'expired', by: null, reason, atMs: nowMs, isGone: false });
  }

  control(event: ControlEvent, droneName: string, me: User | null, nowMs: number): void {
    const { drone_id: droneId, by, reason } = event;
    const known = this.#losses.get().get(droneId);
    const isLoss = event.event === 'taken' || event.event === 'revoked' || event.event === 'expired';
    const wasMine = this.#leftAt.get(droneId) === event.epoch || known?.kind === 'removed';
    if (!isLoss || !me || event.holder?.id === me.id) {
      if (isLoss || event.event === 'released') this.#leftAt.delete(droneId);
      return;
    }
    const isStillTaken = known?.kind === 'taken' && event.event === 'taken';
    if (!wasMine && !isStillTaken) return;
    this.#leftAt.delete(droneId);
    const kind = event.event as LossKind;
    this.#put({
      droneId,
      droneName,
      kind,
      by: by ?? known?.by ?? null,
      reason,
      atMs: known?.atMs ?? nowMs,
      isGone: known?.isGone ?? false,
    });
  }

  /** The user may no longer see the drone. */
  removed(drone: Drone, me: User | null, nowMs: number): void {
    if (!me) return;
    const known = this.#losses.get().get(drone.id);
    const wasMine = drone.holder?.id === me.id || this.#leftAt.has(drone.id);
    this.#leftAt.delete(drone.id);
    if (known) this.#put({ ...known, isGone: true });
    else if (wasMine) {
      this.#put({ ...named(drone), kind: 'removed', by: null, reason: '', atMs: nowMs, isGone: true });
    }
  }

  dismiss(droneId: number): void {
    if (!this.#losses.get().has(droneId)) return;
    const next = new Map(this.#losses.get());
    next.delete(droneId);
    this.#losses.set(next);
  }

  clear(): void {
    this.#leftAt.clear();
    this.#losses.set(new Map());
  }

  #put(loss: LostControls): void {
    this.#losses.update((losses) => new Map(losses).set(loss.droneId, loss));
  }
}

const named = (drone: Drone): { droneId: number; droneName: string } => ({ droneId: drone.id, droneName: drone.name });
