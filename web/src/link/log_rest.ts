/** Requests about an autopilot's flight logs: those on board, and those that the tower has fetched. */

import type { Operation } from './operation_types';
import type { Operations } from './operations';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';

export type FlightLog = Schemas['LogView'];
export type KeptLog = Schemas['KeptLogView'];
export type FlightLogs = Schemas['LogsView'];

export interface LogLine extends FlightLog {
  readonly isOnBoard: boolean;
  readonly isKept: boolean;
}

/**
 * Each log once, whether on board, at the tower, or both. A kept log with a different start time is a different log.
 */
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
    return this.#rest.call('GET', '/drones/{drone_id}/logs', { path: { drone_id: droneId } });
  }

  /** From the autopilot; on the ground only. */
  list(droneId: number): Promise<Operation> {
    return this.#operations.start('POST', '/drones/{drone_id}/logs/list', { path: { drone_id: droneId } });
  }

  /** For the holder of the controls: it takes the drone's whole link. */
  fetch(droneId: number, logId: number): Promise<Operation> {
    const path = { drone_id: droneId, log_id: logId };
    return this.#operations.start('POST', '/drones/{drone_id}/logs/{log_id}/fetch', { path });
  }
}

export const logFileHref = (droneId: number, logId: number): string => `/api/v1/drones/${droneId}/logs/${logId}/file`;
