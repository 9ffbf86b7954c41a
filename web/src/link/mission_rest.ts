/** Requests about plans: those on a drone, and the library on the tower. Items go as rows, in the wire's order. */

import type { Operation, PlanKind, PlanOnBoard } from './operation_types';
import type { Operations } from './operations';
import type { Rest } from './rest';
import type { UserRef } from './wire_types';

/** command, frame, four parameters (null: not given), x, y, z, autocontinue. */
export type Row = readonly [
  number,
  number,
  readonly [number | null, number | null, number | null, number | null],
  number,
  number,
  number,
  number,
];

export interface PlanRead extends PlanOnBoard {
  readonly items: readonly Row[] | null;
  readonly read_at: string | null;
}

/** A plan in the library, without the plan. */
export interface SavedMission {
  readonly id: number;
  readonly name: string;
  readonly owner: UserRef;
  /** Everybody may read it. */
  readonly shared: boolean;
  readonly updated_at: string;
  readonly counts: { readonly mission: number; readonly fence: number; readonly rally: number };
  /** Grows with each change; a writer says which one theirs follows. */
  readonly version: number;
}

export interface SavedMissionWhole extends SavedMission {
  readonly document: unknown;
}

export interface MissionBody {
  readonly name: string;
  readonly document: unknown;
  readonly shared: boolean;
}

const MISSIONS = '/missions';

export class MissionRest {
  readonly #rest: Rest;
  readonly #operations: Operations;

  constructor(rest: Rest, operations: Operations) {
    this.#rest = rest;
    this.#operations = operations;
  }

  /** `fresh`: read from the autopilot now. */
  plan(droneId: number, kind: PlanKind, fresh: boolean): Promise<PlanRead> {
    return this.#rest.call('GET', `/drones/${droneId}/${kind}${fresh ? '?fresh=true' : ''}`);
  }

  upload(droneId: number, kind: PlanKind, items: readonly Row[], whileFlying: boolean): Promise<Operation> {
    const body = whileFlying ? { items, while_flying: true } : { items };
    return this.#operations.start('PUT', `/drones/${droneId}/${kind}`, body);
  }

  clear(droneId: number, kind: PlanKind, whileFlying: boolean): Promise<Operation> {
    return this.#operations.start('DELETE', `/drones/${droneId}/${kind}${whileFlying ? '?while_flying=true' : ''}`);
  }

  verify(droneId: number, kind: PlanKind, items: readonly Row[]): Promise<Operation> {
    return this.#operations.start('POST', `/drones/${droneId}/${kind}/verify`, { items });
  }

  missions(): Promise<readonly SavedMission[]> {
    return this.#rest.call('GET', MISSIONS);
  }

  mission(id: number): Promise<SavedMissionWhole> {
    return this.#rest.call('GET', `${MISSIONS}/${id}`);
  }

  addMission(whole: MissionBody): Promise<SavedMission> {
    return this.#rest.call('POST', MISSIONS, whole);
  }

  /** `version`: of what this follows. Raises a RestError of status 412 when somebody else saved meanwhile. */
  saveMission(id: number, version: number, whole: MissionBody): Promise<SavedMission> {
    return this.#rest.call('PUT', `${MISSIONS}/${id}`, whole, { 'If-Match': `"${version}"` });
  }

  removeMission(id: number): Promise<void> {
    return this.#rest.call('DELETE', `${MISSIONS}/${id}`);
  }
}
