/** What the tower says of work at a drone (docs/api.md): operations, the plans on board, the parameters that it knows. */

import type { UserRef } from './wire_types';

export type PlanKind = 'mission' | 'fence' | 'rally';
export const PLAN_KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];

export type OperationWork =
  | 'plan_upload'
  | 'plan_download'
  | 'plan_clear'
  | 'plan_verify'
  | 'parameters_read'
  | 'parameters_write'
  | 'command'
  | 'log_list'
  | 'log_download'
  | 'follow'
  | 'follow_me';

export type OperationState = 'running' | 'done' | 'refused' | 'failed' | 'cancelled' | 'timed_out';

/** A parameter that is not as it was asked to be. */
export interface Refusal {
  readonly name: string;
  readonly asked: number;
  /** What the autopilot has now; null where nobody knows. */
  readonly has: number | null;
  readonly words: string;
}

/** A piece of work that the agent does beside the autopilot. */
export interface Operation {
  readonly id: string;
  readonly drone_id: number;
  /** A newer tower may know others. */
  readonly work: OperationWork | (string & {});
  readonly kind: PlanKind | null;
  readonly state: OperationState;
  /** What it does now, for people. */
  readonly phase: string;
  /** Of `total`, in this phase; `total` 0: nobody can say. */
  readonly done: number;
  readonly total: number;
  /** One sentence: what failed, why, and what is on board now. Empty while it runs. */
  readonly words: string;
  /** The item of the plan that was refused, from 0. */
  readonly item: number | null;
  readonly code: string;
  readonly hash: string | null;
  /** The first of `refused`. */
  readonly refusals: readonly Refusal[];
  readonly refused: number;
  /** Of a list of logs, the newest first. */
  readonly logs?:
    readonly { readonly id: number; readonly size_bytes: number; readonly began_at: string | null }[] | null;
  readonly by: UserRef | null;
  readonly began_at: string;
  readonly ended_at: string | null;
}

/** The plan of one kind on a drone, as its agent knows it. */
export interface PlanOnBoard {
  readonly kind: PlanKind;
  readonly state: 'known' | 'unknown' | (string & {});
  /** Of the plan as the autopilot has it; null: not known. */
  readonly hash: string | null;
  /** Of the plan that was sent, where the autopilot kept some fields in its own way. */
  readonly sent_hash: string | null;
  readonly count: number;
  /** False: it may be half of one, and the agent lets no mission be started. */
  readonly fit_to_fly: boolean;
}

export interface ParametersKnown {
  /** Null while they are being read. */
  readonly hash: string | null;
  readonly count: number;
  readonly total: number;
}

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
