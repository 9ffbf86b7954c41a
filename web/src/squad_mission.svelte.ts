/**
 * The state of the squad mission page: selected drones, drawing, settings, the resulting plans, and their execution.
 */

import { SvelteSet } from 'svelte/reactivity';

import { commandDrone } from './link/drone_commands';
import { distanceM } from './link/geometry';
import { USUAL_FAMILY } from './link/generated/autopilots.gen';
import { familyOf } from './link/modes';
import type { Place } from './link/messages';
import { isMissionFlown } from './link/mission_progress';
import { MissionRest } from './link/mission_rest';
import type { Operation } from './link/operation_types';
import { isOver, type Operations } from './link/operations';
import type { Vehicle } from './link/vehicle';
import type { User } from './link/wire_types';
import { USUAL_FIGURES } from './plan/estimates';
import { planHash } from './plan/plan_hash';
import { spotOf, type Plan, type PlannedHome, type Spot } from './plan/plan_types';
import { timedPath, type TimedPath } from './plan/timed_path';
import { itemsOf, rowOf } from './plan/wire_items';
import { inTurn, type SquadAnswer, type SquadAction, type SquadTower } from './squad/squad_flight';
import { onGround, squadPlan, USUAL_SQUAD, type Member, type SquadPart, type SquadSettings } from './squad/squad_plan';
import { partProgress, type PartProgress } from './squad/squad_progress';
import { theGround } from './terrain/the_ground';
import { tower } from './tower.svelte';

export type SquadWork = 'upload' | 'start' | 'hold';

/** The reported position of a parked drone varies by a metre or two: its plan must not change with it. */
const MOVED_M = 4;

/** Whether this part's mission is the one on board its drone. */
export type Standing = 'on the drone' | 'another' | 'none' | 'unknown';

export class SquadMission {
  readonly chosen = new SvelteSet<number>();
  area = $state.raw<readonly Spot[]>([]);
  settings = $state.raw<SquadSettings>(USUAL_SQUAD);
  answers = $state.raw<ReadonlyMap<number, SquadAnswer>>(new Map());
  work = $state<SquadWork | null>(null);
  isStopping = $state(false);
  /** The position of each at the last check. */
  #homes = $state.raw<ReadonlyMap<number, PlannedHome>>(new Map());
  readonly #user: User;
  readonly #rest = new MissionRest(tower.rest, tower.operations);
  readonly #ground = theGround();

  constructor(user: User, droneIds: readonly number[]) {
    this.#user = user;
    for (const droneId of droneIds) this.chosen.add(droneId);
  }

  readonly #flat = $derived.by(() => squadPlan(this.#members(), { area: this.area }, this.settings));
  readonly plan = $derived.by(() => {
    const { isThere, at } = this.#ground;
    return isThere ? onGround(this.#flat, { area: this.area }, this.settings, at) : this.#flat;
  });
  /** Whether this tower has elevation. */
  get hasGround(): boolean {
    return this.#ground.isThere === true;
  }
  readonly isBusy = $derived(this.work !== null);

  set(changes: Partial<SquadSettings>): void {
    this.settings = { ...this.settings, ...changes };
  }

  addCorner({ latDeg, lonDeg }: Place): void {
    this.area = [...this.area, spotOf(latDeg, ((((lonDeg + 180) % 360) + 360) % 360) - 180)];
  }

  /**
   * Periodic check for drones that moved, or were reported for the first time. In flight, or without a report, a
   * drone's home stays the same.
   */
  look(vehicles: ReadonlyMap<number, Vehicle>, nowMs: number): void {
    let next: Map<number, PlannedHome> | null = null;
    for (const droneId of this.chosen) {
      const values = vehicles.get(droneId)?.values(nowMs);
      const place = values && (values.airborne === false ? values.place : values.home);
      if (!values || !place) continue;
      const known = this.#homes.get(droneId);
      const before = known && { latDeg: known.spot.latE7 / 1e7, lonDeg: known.spot.lonE7 / 1e7 };
      if (before && distanceM(before, place) < MOVED_M) continue;
      const altM = Math.round((values.altAmslM ?? 0) - (values.altRelM ?? 0));
      next ??= new Map(this.#homes);
      next.set(droneId, { spot: spotOf(place.latDeg, place.lonDeg), altM });
    }
    if (next) this.#homes = next;
  }

  #members(): Member[] {
    const vehicles = tower.vehicles.get();
    return [...this.chosen].flatMap((id): Member[] => {
      const vehicle = vehicles.get(id);
      if (!vehicle) return [];
      const autopilot = familyOf(vehicle.values(tower.clock.nowMs()).autopilot) ?? USUAL_FAMILY;
      const { name } = vehicle.drone.get();
      return [{ id, name, home: this.#homes.get(id) ?? null, autopilot }];
    });
  }

  standing(part: SquadPart): Standing {
    const reported = tower.vehicles.get().get(part.member.id)?.plans.get().mission;
    if (!reported || reported.hash === null) return 'unknown';
    if (reported.count === 0) return 'none';
    const hash = hashOf(part.plan);
    return reported.fit_to_fly && (hash === reported.hash || hash === reported.sent_hash) ? 'on the drone' : 'another';
  }

  /** How far this part is flown; null: it is not flown, or not known. */
  progress(part: SquadPart): PartProgress | null {
    const vehicle = tower.vehicles.get().get(part.member.id);
    if (!vehicle || this.standing(part) !== 'on the drone') return null;
    const values = vehicle.values(tower.clock.nowMs());
    const { current, reached } = vehicle.mission.now.get();
    const last = part.plan.items.length - 1;
    return partProgress({
      path: timedPathOf(part.plan),
      current,
      here: values.place && spotOf(values.place.latDeg, values.place.lonDeg),
      isFlown: isMissionFlown(values),
      // The last item may be the way home, which autopilots do not report as reached.
      isDone: values.airborne === false && (reached.has(last) || reached.has(last - 1)),
    });
  }

  upload(parts: readonly SquadPart[]): Promise<void> {
    const rows = new Map(parts.map(({ member, plan }) => [member.id, itemsOf(plan, 'mission').map(rowOf)]));
    return this.#run('upload', idsOf(parts), (drone, report) =>
      followed(tower.operations, this.#rest.upload(drone.id, 'mission', rows.get(drone.id)!, false), report),
    );
  }

  /** In the order of the parts, with the time between them that the conflict check assumed. */
  start(parts: readonly SquadPart[]): Promise<void> {
    return this.#run('start', idsOf(parts), command('start'), this.settings.startEveryS, true);
  }

  /** Regardless of the plans that this page knows: it may have been opened during their flight. */
  hold(droneIds: readonly number[]): Promise<void> {
    // Breaks off the current run, and starts no further drone: a hold waits for nothing.
    this.isStopping = true;
    for (const one of tower.operations.all.get().values()) {
      const isOurs = this.isBusy && !isOver(one) && this.chosen.has(one.drone_id) && one.by?.id === this.#user.id;
      if (isOurs) void tower.operations.cancel(one.id).catch(() => undefined); // it is over already, or will be
    }
    return this.#run('hold', droneIds, command('hold'));
  }

  async #run(
    work: SquadWork,
    droneIds: readonly number[],
    action: SquadAction,
    everyS = 0,
    stopsAtFailure = false,
  ): Promise<void> {
    await this.#atWork;
    const way: SquadTower = {
      user: this.#user,
      drone: (droneId) => tower.vehicles.get().get(droneId)?.drone.get(),
      acquire: (droneId) => tower.control(droneId, 'acquire'),
      release: (droneId) => tower.control(droneId, 'release'),
    };
    this.work = work;
    this.isStopping = false;
    this.answers = new Map();
    const run = inTurn(way, {
      droneIds,
      action,
      everyS,
      stopsAtFailure,
      isStopped: () => this.isStopping,
      onanswer: (droneId, answer) => (this.answers = new Map(this.answers).set(droneId, answer)),
    }).finally(() => (this.work = null));
    this.#atWork = run;
    await run;
  }

  #atWork: Promise<unknown> = Promise.resolve();
}

const idsOf = (parts: readonly SquadPart[]): number[] => parts.map(({ member }) => member.id);

const paths = new WeakMap<Plan, TimedPath>();

function timedPathOf(plan: Plan): TimedPath {
  const path = paths.get(plan) ?? timedPath(plan, USUAL_FIGURES);
  paths.set(plan, path);
  return path;
}

const hashes = new WeakMap<Plan, string>();

function hashOf(plan: Plan): string {
  const hash = hashes.get(plan) ?? planHash('mission', itemsOf(plan, 'mission'));
  hashes.set(plan, hash);
  return hash;
}

const command =
  (name: 'start' | 'hold'): SquadAction =>
  (drone, report) =>
    followed(tower.operations, commandDrone(tower.operations, drone.id, { command: name }), report);

/** Reports progress, and resolves to the ended operation. */
async function followed(
  operations: Operations,
  begun: Promise<Operation>,
  report: (operation: Operation) => void,
): Promise<Operation> {
  const { id } = await begun;
  const stop = operations.all.subscribe((all) => {
    const now = all.get(id);
    if (now) report(now);
  });
  try {
    return await operations.ended(id);
  } finally {
    stop();
  }
}
