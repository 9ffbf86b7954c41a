/** Requests about the flight logs of an autopilot: which there are on board, and those that the tower has fetched. */

import type { Operation } from './operation_types';
import type { Operations } from './operations';
import type { Rest } from './rest';

export interface FlightLog {
  readonly id: number;
  readonly size_bytes: number;
  /** Null: the autopilot's clock was not set. */
  readonly began_at: string | null;
}

export interface KeptLog extends FlightLog {
  readonly kept_at: string;
}

/** Newest first. */
export interface FlightLogs {
  /** When the list was read from the autopilot; null: not since the tower runs. */
  readonly read_at: string | null;
  /** Null: not known. */
  readonly on_board: readonly FlightLog[] | null;
  readonly kept: readonly KeptLog[];
}

export interface LogLine extends FlightLog {
  readonly isOnBoard: boolean;
  readonly isKept: boolean;
}

/** Each log once, whether it is on board, at the tower, or both. A kept one of another beginning is another log. */
export function logLines({ on_board, kept }: FlightLogs): LogLine[] {
  const isSame = (one: FlightLog, other: FlightLog): boolean =>
    one.id === other.id && one.size_bytes === other.size_bytes && one.began_at === other.began_at;
  const board = on_board ?? [];
  const only = kept.filter((one) => !board.some((other) => isSame(one, other)));
  return [
    ...board.map((one) => ({ ...one, isOnBoard: true, isKept: kept.some((other) => isSame(one, other)) })),
    ...only.map((one) => ({ ...one, isOnBoard: false, isKept: true })),
  ];
}

export class LogRest {
  readonly #rest: Rest;
  readonly #operations: Operations;

  constructor(rest: Rest, operations: Operations) {
    this.#rest = rest;
    this.#operations = operations;
  }

  known(droneId: number): Promise<FlightLogs> {
    return this.#rest.call('GET', `/drones/${droneId}/logs`);
  }

  /** From the autopilot; on the ground only. */
  list(droneId: number): Promise<Operation> {
    return this.#operations.start('POST', `/drones/${droneId}/logs/list`);
  }

  /** By whoever has the controls: it takes the drone's whole link. */
  fetch(droneId: number, logId: number): Promise<Operation> {
    return this.#operations.start('POST', `/drones/${droneId}/logs/${logId}/fetch`);
  }
}

export const logFileHref = (droneId: number, logId: number): string => `/api/v1/drones/${droneId}/logs/${logId}/file`;
