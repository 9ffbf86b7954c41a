/** The tower's reports on work at a drone (docs/api.md): operations, plans on board, known parameters. */

import type { Schemas } from './rest_types';

export type PlanKind = Schemas['PlanKind'];
export const PLAN_KINDS = ['mission', 'fence', 'rally'] as const satisfies readonly PlanKind[];

/** Work that the agent does beside the autopilot. */
export type Operation = Schemas['OperationView'];
export type OperationWork = Operation['work'];
export type OperationState = Operation['state'];
/** A parameter whose value differs from the requested one. */
export type Refusal = Schemas['RefusalView'];
/** The plan of one kind on a drone, as its agent reports it. */
export type PlanOnBoard = Schemas['OnboardPlanView'];
export type ParametersKnown = Schemas['ParametersStateView'];

export interface OperationEvent {
  readonly type: 'operation';
  readonly operation: Operation;
}

export interface PlanOnBoardEvent extends PlanOnBoard {
  readonly type: 'plan_on_board';
  readonly drone_id: number;
}

export interface ParametersEvent extends ParametersKnown {
  readonly type: 'parameters';
  readonly drone_id: number;
}
