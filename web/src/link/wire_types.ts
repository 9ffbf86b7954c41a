/** What the tower says in JSON, as docs/wire-protocol.md (1.2) defines it. */

import type { Enrolment, Loan } from './admin_types';
import type {
  OperationEvent,
  ParametersEvent,
  ParametersKnown,
  PlanKind,
  PlanOnBoard,
  PlanOnBoardEvent,
} from './operation_types';
import type { RecordingEvent } from './recordings';

export interface User {
  readonly id: number;
  readonly name: string;
  readonly role: 'admin' | 'operator';
  /** Somebody else made the password: nothing else may be done before a new one. Only REST says it. */
  readonly must_change_password?: boolean;
  readonly second_factor?: boolean;
  /** An admin without a second factor, where the tower demands one: nothing else may be done before. */
  readonly must_add_second_factor?: boolean;
}

export interface UserRef {
  readonly id: number;
  readonly name: string;
}

/** Somebody with live connections: browsers and programs. */
export interface Online {
  readonly user: UserRef;
  readonly connections: number;
}

/** What the drone does by itself when the tower or the person stays away. `stay`: until the battery needs the way home. */
export type LostAction = 'return' | 'land' | 'continue' | 'stay';

/** An open hold and a lost action, as the drone's agent told last (wire/open_holds.py). */
export interface HoldView {
  /** From its order until somebody flies, the lost action is done, or the drone is disarmed. */
  readonly open: boolean;
  /** `altitude`: the height alone, with the agent's centred sticks; `stay`: a mode that uses nobody's sticks. */
  readonly stage: 'none' | 'altitude' | 'stay';
  /** The autopilot's mode, by name. */
  readonly mode: string;
  /** The agent keeps centred sticks coming. */
  readonly sticks: boolean;
  /** What the autopilot does by itself when those stop, or the agent dies. */
  readonly after_sticks: 'stays' | 'sinks' | 'returns' | 'lands' | 'unknown';
  /** Why it is not yet in the stage `stay`, for people. */
  readonly waiting_for: string;
  readonly lost: 'tower' | 'person' | null;
  readonly phase: 'quiet' | 'counting' | 'stayed' | 'asking' | 'done';
  readonly action: LostAction | null;
  /** By the tower's clock; null unless counting. */
  readonly due_at: string | null;
  readonly detail: string;
  readonly as_of: string;
  /** The agent's link is down: this is what it told last. */
  readonly stale: boolean;
}

/** How much telemetry a drone sends. */
export type StreamProfile = 'full' | 'thin' | 'minimal';

/** By what the tower knows a drone's agent. `credential`: a bearer secret, until the agent's next sign-in. */
export interface DroneIdentity {
  readonly kind: 'none' | 'credential' | 'key';
  /** `SHA256:...` of the key's public half. */
  readonly fingerprint: string | null;
  /** When the key was enrolled. */
  readonly since: string | null;
}
/** How this user stands to a drone, from the strongest to the weakest: docs/teams.md says what each may do. */
export type Relation = 'admin' | 'team-admin' | 'owner' | 'team-operator' | 'borrower' | 'observer' | 'stranger';

export interface Drone {
  readonly id: number;
  readonly name: string;
  readonly online: boolean;
  readonly owners: readonly UserRef[];
  readonly holder: UserRef | null;
  readonly epoch: number;
  readonly taken_from: UserRef | null;
  readonly autopilot_heard: boolean;
  /** Null: not known, because the autopilot is silent or the agent is not there. */
  readonly armed: boolean | null;
  readonly airborne: boolean | null;
  /** When it left the ground, by the tower's clock; null where the tower does not know. */
  readonly airborne_since: string | null;
  /** The controls were given back to `taken_from`, who has not accepted yet. */
  readonly offered: boolean;
  readonly assistant: UserRef | null;
  /** False for an operator from whom the view was taken as well. */
  readonly may_watch: boolean;
  /** False for an operator from whom the video was taken, or the whole view. */
  readonly may_watch_video: boolean;
  readonly lost_action: LostAction;
  readonly lost_action_s: number;
  /** Null where no hold is open, nobody is lost, and no lost action is under way or just done. */
  readonly hold: HoldView | null;
  /** In force now, as the agent says; null while that is not known. */
  readonly profile: StreamProfile | null;
  /** What an admin chose; `auto`: the agent decides. */
  readonly profile_chosen: StreamProfile | 'auto';
  /** Why it is this profile, for people. */
  readonly profile_why: string;
  /** Who may use it until when, besides its owners. */
  readonly loans?: readonly Loan[];
  readonly identity?: DroneIdentity;
  /** What is on board of each kind, in what a watcher hears first; `plan_on_board` says the changes. */
  readonly plans?: Readonly<Partial<Record<PlanKind, PlanOnBoard>>>;
  readonly parameters?: ParametersKnown | null;
  /** Armed, it does not move as a machine can: what the tower found in the last minute. */
  readonly suspicious_motion?: 'jump' | 'speed' | 'height' | 'course' | null;
  /** An older tower does not say it. */
  readonly relation?: Relation;
  /** The team that it belongs to, where that is this user's to know. */
  readonly team?: UserRef | null;
}

export type ControlChange =
  'acquired' | 'released' | 'taken' | 'given' | 'accepted' | 'assisting' | 'assist_ended' | 'revoked' | 'expired';

export interface ControlEvent {
  readonly type: 'control';
  readonly drone_id: number;
  /** A newer tower may know others. */
  readonly event: ControlChange | (string & {});
  readonly epoch: number;
  readonly holder: UserRef | null;
  readonly by: UserRef | null;
  readonly reason: string;
}

export interface HoldEvent {
  readonly type: 'hold';
  readonly drone_id: number;
  readonly epoch: number;
  readonly step: string;
  readonly detail: string;
  readonly elapsed_ms: number;
  readonly cause?: string;
}

/** While an admin assists: whose frames pass now. */
export interface TurnEvent {
  readonly type: 'turn';
  readonly drone_id: number;
  readonly user: UserRef;
}

export type RehearsedLoss = 'operator' | 'tower';

export interface RehearsalEvent {
  readonly type: 'rehearsal';
  readonly drone_id: number;
  readonly what: RehearsedLoss;
  readonly phase: 'begun' | 'held' | 'not_needed' | 'failed' | 'ended' | (string & {});
  readonly hold_ms: number | null;
  readonly text: string;
  /** How long the loss itself lasts. */
  readonly lasts_s: number;
}

/** The link over a while; null is: not known. Losses are shares, 0..1. */
export interface LinkOver {
  readonly rtt_ms: number | null;
  readonly jitter_ms: number | null;
  readonly loss_up: number | null;
  readonly loss_down: number | null;
}

/** The check before flight says something else than before. */
export interface LossCheckEvent {
  readonly type: 'loss_check';
  readonly drone_id: number;
}

export interface LinkQuality {
  readonly drone_id: number;
  /** Smoothed; null before the first measurement. */
  readonly rtt_ms: number | null;
  /** Share of lost pings, 0..1. */
  readonly loss: number;
  readonly over_1s: LinkOver;
  readonly over_30s: LinkOver;
  /** Bytes of the largest datagram known to pass to the agent. */
  readonly path_mtu: number;
  readonly transport: 'udp' | 'websocket';
  /** By how many ways the agent comes at the moment. */
  readonly uplinks: number;
}

export interface LinksEvent {
  readonly type: 'links';
  readonly links: readonly LinkQuality[];
}

export interface NoticeEvent {
  readonly type: 'notice';
  readonly severity: 'info' | 'warning' | 'error';
  readonly code: string;
  readonly text: string;
  readonly drone_id: number | null;
  readonly count: number;
}

/** Two drones come near each other, or do so no more (docs/separation.md). */
export interface SeparationEvent {
  readonly type: 'separation';
  /** Stays the same from the first word to `clear`. */
  readonly number: number;
  readonly level: 'caution' | 'warning' | 'clear';
  /** The second is null where we may not see it; then all figures are rounded. */
  readonly drones: readonly [number, number | null];
  /** Predicted: when they are closest, and how far apart they are then. */
  readonly in_s: number | null;
  readonly horizontal_m: number | null;
  readonly vertical_m: number | null;
  /** Where the second is now, seen from the first. */
  readonly bearing_deg: number | null;
  readonly distance_m: number | null;
  readonly above_m: number | null;
  readonly why: string;
}

/** An invitation of a drone came further (docs/api.md); said to admins. */
export interface EnrolmentEvent {
  readonly type: 'enrolment';
  readonly enrolment: Enrolment;
}

export type TowerEvent =
  | { readonly type: 'welcome'; readonly user: User; readonly drones: readonly Drone[]; readonly server_time: string }
  | { readonly type: 'drone'; readonly drone: Drone }
  | { readonly type: 'drone_removed'; readonly drone_id: number }
  | { readonly type: 'ping'; readonly sequence: number }
  | { readonly type: 'lost'; readonly drone_id: number; readonly count: number }
  | ControlEvent
  | EnrolmentEvent
  | HoldEvent
  | LinksEvent
  | LossCheckEvent
  | NoticeEvent
  | OperationEvent
  | ParametersEvent
  | PlanOnBoardEvent
  | RecordingEvent
  | RehearsalEvent
  | SeparationEvent
  | TurnEvent;

const KNOWN_TYPES: ReadonlySet<string> = new Set<TowerEvent['type']>([
  'welcome',
  'drone',
  'drone_removed',
  'ping',
  'lost',
  'control',
  'enrolment',
  'hold',
  'links',
  'loss_check',
  'notice',
  'operation',
  'parameters',
  'plan_on_board',
  'recording',
  'rehearsal',
  'separation',
  'turn',
]);

/** Null for anything unknown: the protocol lets the tower say more than this console understands. */
export function readTowerEvent(text: string): TowerEvent | null {
  try {
    const value: unknown = JSON.parse(text);
    if (typeof value !== 'object' || value === null) return null;
    const { type } = value as { type?: unknown };
    return typeof type === 'string' && KNOWN_TYPES.has(type) ? (value as TowerEvent) : null;
  } catch {
    return null;
  }
}
