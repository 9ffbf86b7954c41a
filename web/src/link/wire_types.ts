/** What the tower says in JSON, as docs/wire-protocol.md (1.2) defines it. */

export interface User {
  readonly id: number;
  readonly name: string;
  readonly role: 'admin' | 'operator';
}

export interface UserRef {
  readonly id: number;
  readonly name: string;
}

export interface Drone {
  readonly id: number;
  readonly name: string;
  readonly online: boolean;
  readonly owners: readonly UserRef[];
  readonly holder: UserRef | null;
  readonly epoch: number;
  readonly taken_from: UserRef | null;
  readonly autopilot_heard: boolean;
}

export type ControlChange = 'acquired' | 'released' | 'taken' | 'given' | 'revoked' | 'expired';

export interface ControlEvent {
  readonly type: 'control';
  readonly drone_id: number;
  readonly event: ControlChange;
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
}

export interface LinkEvent {
  readonly type: 'link';
  readonly drone_id: number;
  readonly rtt_ms: number | null;
  readonly loss: number;
}

export interface NoticeEvent {
  readonly type: 'notice';
  readonly severity: 'info' | 'warning' | 'error';
  readonly code: string;
  readonly text: string;
  readonly drone_id: number | null;
  readonly count: number;
}

export type TowerEvent =
  | { readonly type: 'welcome'; readonly user: User; readonly drones: readonly Drone[]; readonly server_time: string }
  | { readonly type: 'drone'; readonly drone: Drone }
  | { readonly type: 'drone_removed'; readonly drone_id: number }
  | ControlEvent
  | HoldEvent
  | LinkEvent
  | NoticeEvent
  | { readonly type: 'lost'; readonly drone_id: number; readonly count: number };

const KNOWN_TYPES = new Set(['welcome', 'drone', 'drone_removed', 'control', 'hold', 'link', 'notice', 'lost']);

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
