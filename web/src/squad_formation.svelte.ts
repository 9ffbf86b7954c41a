/** The state of the formation part of the squad page: leader, settings, followers and their places, and progress. */

import { t } from './languages/text';
import { followLeader } from './link/drone_commands';
import { distanceM, offsetBy } from './link/geometry';
import type { Operation } from './link/operation_types';
import { isOver, newestOf } from './link/operations';
import type { User } from './link/wire_types';
import { FOLLOW_FOR_S, type FollowPlace } from './squad/follow_place';
import { USUAL_FORMATION, type Flier, type FormationSettings } from './squad/formation';
import { followAnswer, formUp, type FormationAnswer, type FormationRun } from './squad/formation_flight';
import { tower } from './tower.svelte';

const LOOK_EVERY_MS = 200;

export class SquadFormation {
  leaderId = $state<number | null>(null);
  settings = $state.raw<FormationSettings>(USUAL_FORMATION);
  answers = $state.raw<ReadonlyMap<number, FormationAnswer>>(new Map());
  isForming = $state(false);
  isStopping = $state(false);
  readonly #user: User;

  constructor(user: User) {
    this.#user = user;
  }

  set(changes: Partial<FormationSettings>): void {
    this.settings = { ...this.settings, ...changes };
  }

  /** Its current position; a string: why it cannot take part, for people. */
  flier(droneId: number): Flier | string {
    const vehicle = tower.vehicles.get().get(droneId);
    if (!vehicle) return t('One of them is no longer in your squad.');
    const { name } = vehicle.drone.get();
    const { airborne, place, altAmslM } = vehicle.values(tower.clock.nowMs());
    if (airborne === null) return t('It is not known whether {name} is in the air.', { name });
    if (!airborne) return t('{name} is not in the air.', { name });
    if (!place || altAmslM === null) return t('The position of {name} is not known.', { name });
    return { id: droneId, name, place, altM: altAmslM };
  }

  /** Sends each of these to its place at the leader, in this order. */
  async form(leaderId: number, ways: FormationRun['ways']): Promise<void> {
    if (this.isForming) return;
    this.isForming = true;
    this.isStopping = false;
    this.answers = new Map();
    const put = (droneId: number, answer: FormationAnswer): void => {
      this.answers = new Map(this.answers).set(droneId, answer);
    };
    try {
      await formUp(
        {
          user: this.#user,
          drone: (droneId) => tower.vehicles.get().get(droneId)?.drone.get(),
          acquire: (droneId) => tower.control(droneId, 'acquire'),
          follow: (droneId, { northM, eastM, upM }) =>
            followLeader(tower.operations, droneId, {
              command: 'follow',
              leader: leaderId,
              north_m: northM,
              east_m: eastM,
              up_m: upM,
              for_s: FOLLOW_FOR_S,
            }),
          watch: watchOperation,
          offPlaceM: (droneId, place) => offPlaceM(leaderId, droneId, place),
          wait: () => new Promise((resolve) => setTimeout(resolve, LOOK_EVERY_MS)),
          nowMs: () => performance.now(),
        },
        { ways, isStopped: () => this.isStopping, onanswer: put },
      );
    } finally {
      this.isForming = false;
    }
  }

  /**
   * Those of these drones that follow, whoever commanded it: the tower reports them to a page that was opened
   * meanwhile.
   */
  following(droneIds: Iterable<number>, all: ReadonlyMap<string, Operation>): Operation[] {
    return [...droneIds].flatMap((droneId) => {
      const newest = newestOf(all, droneId, ['follow']);
      return newest && !isOver(newest) ? [newest] : [];
    });
  }

  answerOf(droneId: number, all: ReadonlyMap<string, Operation>): FormationAnswer | null {
    const ours = this.answers.get(droneId) ?? null;
    const newest = newestOf(all, droneId, ['follow']);
    if (!newest || newest.id === ours?.operationId || isOver(newest)) return ours;
    return followAnswer(newest, true);
  }

  /** Each holds in place, by its own agent. Waiting drones are no longer sent. */
  async stop(operations: readonly Operation[]): Promise<void> {
    this.isStopping = true;
    await Promise.allSettled(operations.map(({ id }) => tower.operations.cancel(id))); // an ended one has stopped
  }
}

/** Metres from its place at the leader; the larger of horizontal and vertical. */
function offPlaceM(leaderId: number, droneId: number, place: FollowPlace): number | null {
  const vehicles = tower.vehicles.get();
  const nowMs = tower.clock.nowMs();
  const leader = vehicles.get(leaderId)?.values(nowMs);
  const own = vehicles.get(droneId)?.values(nowMs);
  if (!leader?.place || !own?.place || leader.altAmslM === null || own.altAmslM === null) return null;
  const there = offsetBy(leader.place, place.northM, place.eastM);
  return Math.max(distanceM(own.place, there), Math.abs(own.altAmslM - leader.altAmslM - place.upM));
}

function watchOperation(id: string, heard: (operation: Operation) => void): void {
  let known: Operation | undefined;
  let stop: () => void = () => undefined;
  stop = tower.operations.all.subscribe((all) => {
    const now = all.get(id);
    if (!now || now === known) return;
    known = now;
    heard(now);
    if (isOver(now)) queueMicrotask(() => stop());
  });
}
