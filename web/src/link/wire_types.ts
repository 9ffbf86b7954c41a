/** The tower's JSON, as docs/wire-protocol.md (1.2) defines it. */

import type { Enrolment } from './admin_types';
import type { AlertEvent } from './alerts';
import type { FindingEvent } from './findings';
import type { SightingEvent } from './sightings';
import type {
  OperationEvent,
  ParametersEvent,
  ParametersKnown,
  PlanKind,
  PlanOnBoard,
  PlanOnBoardEvent,
} from './operation_types';
import type { RecordingEvent } from './recordings';
import type { Schemas } from './rest_types';

/** Only REST sends more than the identity. */
export type User = Pick<Schemas['Me'], 'id' | 'name' | 'role'> & Partial<Schemas['Me']>;
export type UserRef = Schemas['UserRefView'];
/** A user with live connections: browsers and programs. */
export type Online = Schemas['OnlineView'];
/**
 * What the drone does on its own when the tower or the person stays away. `stay`: until the battery is needed for the
 * way home.
 */
export type LostAction = Schemas['LostAction'];
/** An open hold and a lost action, as the drone's agent last reported (wire/open_holds.py). */
export type HoldView = Schemas['HoldView'];
/** What the autopilot did when the tower heard it last, for pages that open after a loss. */
export type LastHeardView = Schemas['LastHeardView'];
/** How much telemetry a drone sends. */
export type StreamProfile = Schemas['StreamProfile'];
/** How the tower identifies a drone's agent. `credential`: a bearer secret, until the agent's next sign-in. */
export type DroneIdentity = Schemas['IdentityView'];
/** This user's relation to a drone, from the strongest to the weakest: docs/teams.md lists the rights of each. */
export type Relation = Schemas['Relation'];

/** Against a drone that sends too much. */
export type Measure = Schemas['Measure'];

type SaidLater =
  'loans' | 'identity' | 'plans' | 'parameters' | 'suspicious_motion' | 'watched_only' | 'relation' | 'team';

/** As REST and the live channel send it; an older tower omits later fields. */
export interface Drone
  extends
    Omit<Schemas['DroneView'], SaidLater>,
    Partial<Pick<Schemas['DroneView'], Exclude<SaidLater, 'plans' | 'parameters'>>> {
  /** What is on board of each kind, in a watcher's first message; `plan_on_board` reports changes. */
  readonly plans?: Readonly<Partial<Record<PlanKind, PlanOnBoard>>>;
  readonly parameters?: ParametersKnown | null;
}

export type ControlChange =
  'acquired' | 'released' | 'taken' | 'given' | 'accepted' | 'assisting' | 'assist_ended' | 'revoked' | 'expired';

export interface ControlEvent {
  readonly type: 'control';
  readonly drone_id: number;
  /** A newer tower may send others. */
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

export type RehearsedLoss = Schemas['RehearsalRequest']['what'];

export interface RehearsalEvent {
  readonly type: 'rehearsal';
  readonly drone_id: number;
  readonly what: RehearsedLoss;
  readonly phase: 'begun' | 'held' | 'not_needed' | 'failed' | 'ended' | (string & {});
  readonly hold_ms: number | null;
  readonly text: string;
  /** Duration of the loss itself. */
  readonly lasts_s: number;
}

/** The link over a period; null: unknown. Losses are shares, 0..1. */
export interface LinkOver {
  readonly rtt_ms: number | null;
  readonly jitter_ms: number | null;
  readonly loss_up: number | null;
  readonly loss_down: number | null;
}

/** The check before flight has changed. */
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
  /** Bytes of the largest datagram known to reach the agent. */
  readonly path_mtu: number;
  readonly transport: 'udp' | 'websocket';
  /** Number of paths by which the agent is connected at present. */
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

/** Two drones come near each other, or no longer do (docs/separation.md). */
/** An aircraft that is none of the tower's. */
export interface Aircraft {
  readonly key: string;
  readonly manned: boolean;
  readonly name: string;
  readonly lat: number;
  readonly lon: number;
  readonly alt_amsl_m: number | null;
  readonly course_deg: number | null;
  readonly speed_m_s: number | null;
  readonly climb_m_s: number;
  readonly squawk: number | null;
  readonly on_ground: boolean;
  readonly age_s: number;
}

/** All aircraft near one's drones. */
export interface AircraftEvent {
  readonly type: 'aircraft';
  readonly aircraft: readonly Aircraft[];
}

/** Zones have changed: they are to be read again. */
export interface ZonesEvent {
  readonly type: 'zones';
}

export interface SeparationEvent {
  readonly type: 'separation';
  /** Constant from the first report to `clear`. */
  readonly number: number;
  readonly level: 'caution' | 'warning' | 'clear';
  /** The second is null if this user may not see it; then all figures are rounded. */
  readonly drones: readonly [number, number | null];
  /** Predicted: the time of closest approach, and the distance then. */
  readonly in_s: number | null;
  readonly horizontal_m: number | null;
  readonly vertical_m: number | null;
  /** Bearing of the second drone, seen from the first. */
  readonly bearing_deg: number | null;
  readonly distance_m: number | null;
  readonly above_m: number | null;
  readonly why: string;
}

/** An enrolment of a drone progressed (docs/api.md); sent to admins. */
export interface EnrolmentEvent {
  readonly type: 'enrolment';
  readonly enrolment: Enrolment;
}

export type TowerEvent =
  | {
      readonly type: 'welcome';
      readonly user: User;
      readonly drones: readonly Drone[];
      readonly server_time: string;
      /** Open, or waiting for a person; an older tower has none. */
      readonly alerts?: readonly Schemas['AlertView'][];
      /** Another tower takes this page if this one is lost; absent from an older tower. */
      readonly other_towers?: boolean;
    }
  | { readonly type: 'leave_tower' }
  | { readonly type: 'drone'; readonly drone: Drone }
  | { readonly type: 'drone_removed'; readonly drone_id: number }
  | { readonly type: 'ping'; readonly sequence: number }
  | { readonly type: 'lost'; readonly drone_id: number; readonly count: number }
  | AlertEvent
  | ControlEvent
  | EnrolmentEvent
  | FindingEvent
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
  | SightingEvent
  | TurnEvent
  | ZonesEvent
  | AircraftEvent;

const KNOWN_TYPES: ReadonlySet<string> = new Set<TowerEvent['type']>([
  'welcome',
  'drone',
  'drone_removed',
  'ping',
  'leave_tower',
  'lost',
  'alert',
  'control',
  'enrolment',
  'finding',
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
  'sighting',
  'turn',
  'zones',
  'aircraft',
]);

/** Null for anything unknown: the protocol lets the tower send more than this console understands. */
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
