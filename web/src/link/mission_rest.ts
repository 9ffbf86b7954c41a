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

/** A number of an item that the drone's autopilot would not keep. */
export interface PlanChange {
  readonly item: number;
  /** command, frame, param1 to param4, x, y, z, autocontinue. */
  readonly field: string;
  readonly sent: number | null;
  readonly kept: number | null;
  /** `flight`: it flies otherwise; `refused`: the upload will fail. */
  readonly effect: 'flight' | 'refused';
  readonly words: string;
}

/** What becomes of a plan in a drone's autopilot, told before it is sent. */
export interface PlanForeseen {
  readonly autopilot: string;
  readonly changes: readonly PlanChange[];
  readonly count: number;
  /** How many numbers are kept in another way that changes nothing in the flight. */
  readonly quiet: number;
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

  /** Nothing is sent to the drone. */
  foresee(droneId: number, kind: PlanKind, items: readonly Row[]): Promise<PlanForeseen> {
    return this.#rest.call('POST', `/drones/${droneId}/${kind}/kept`, { items });
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
