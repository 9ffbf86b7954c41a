/** Requests about plans: those on a drone, and the tower's library. Items are rows in wire order. */

import type { Operation, PlanKind } from './operation_types';
import type { Operations } from './operations';
import type { Rest } from './rest';
import type { BodyOf, Schemas } from './rest_types';

export type PlanRead = Schemas['PlanView'];
/** command, frame, four parameters (null: not given), x, y, z, autocontinue. */
export type Row = NonNullable<PlanRead['items']>[number];
/** A number of an item that the drone's autopilot would change. */
export type PlanChange = Schemas['ChangeView'];
/** How a drone's autopilot would store a plan, determined before it is sent. */
export type PlanForeseen = Schemas['PlanKeptView'];
/** A plan in the library, without the plan. */
export type SavedMission = Schemas['MissionView'];
export type SavedMissionWhole = Schemas['MissionWithDocument'];
export type MissionBody = BodyOf<'POST', '/missions'>;

const MISSIONS = '/missions';
const MISSION = '/missions/{mission_id}';
const PLAN = '/drones/{drone_id}/{kind}';

export class MissionRest {
  readonly #rest: Rest;
  readonly #operations: Operations;

  constructor(rest: Rest, operations: Operations) {
    this.#rest = rest;
    this.#operations = operations;
  }

  /** `fresh`: read from the autopilot now. */
  plan(droneId: number, kind: PlanKind, fresh: boolean): Promise<PlanRead> {
    const query = fresh ? { fresh } : {};
    return this.#rest.call('GET', PLAN, { path: { drone_id: droneId, kind }, query });
  }

  upload(droneId: number, kind: PlanKind, items: readonly Row[], whileFlying: boolean): Promise<Operation> {
    const body = whileFlying ? { items, while_flying: true } : { items };
    return this.#operations.start('PUT', PLAN, { path: { drone_id: droneId, kind }, body });
  }

  clear(droneId: number, kind: PlanKind, whileFlying: boolean): Promise<Operation> {
    const query = whileFlying ? { while_flying: true } : {};
    return this.#operations.start('DELETE', PLAN, { path: { drone_id: droneId, kind }, query });
  }

  verify(droneId: number, kind: PlanKind, items: readonly Row[]): Promise<Operation> {
    return this.#operations.start('POST', `${PLAN}/verify`, { path: { drone_id: droneId, kind }, body: { items } });
  }

  /** Sends nothing to the drone. */
  foresee(droneId: number, kind: PlanKind, items: readonly Row[]): Promise<PlanForeseen> {
    return this.#rest.call('POST', `${PLAN}/kept`, { path: { drone_id: droneId, kind }, body: { items } });
  }

  missions(): Promise<readonly SavedMission[]> {
    return this.#rest.call('GET', MISSIONS);
  }

  mission(id: number): Promise<SavedMissionWhole> {
    return this.#rest.call('GET', MISSION, { path: { mission_id: id } });
  }

  addMission(whole: MissionBody): Promise<SavedMission> {
    return this.#rest.call('POST', MISSIONS, { body: whole });
  }

  /** `version`: the version this one is based on. Raises RestError with status 412 if another user saved meanwhile. */
  saveMission(id: number, version: number, whole: MissionBody): Promise<SavedMission> {
    const header = { 'if-match': `"${version}"` };
    return this.#rest.call('PUT', MISSION, { path: { mission_id: id }, header, body: whole });
  }

  removeMission(id: number): Promise<void> {
    return this.#rest.call('DELETE', MISSION, { path: { mission_id: id } });
  }
}
