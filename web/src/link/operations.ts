/**
 * Lengthy work at drones: plans, parameters, commands. The tower answers at once with an operation and reports its
 * progress over the live channel. This keeps operations by id, for every view that shows one or waits for its end.
 */

import { t } from '../languages/text';
import type { Operation, OperationWork, PlanKind } from './operation_types';
import { RestError, type LooseRequest, type Rest } from './rest';
import type { AnswerOf, Method, PathOf, RequestArguments } from './rest_types';
import { Store } from './store';
import { operationInWords } from './tower_words';

/** Above this, the oldest ended operations are dropped. */
const MAX_KEPT = 300;
const NOBODY_KNOWS = t('The connection broke, and the tower no longer knows the result.');

/** An id is a string everywhere except in a path. */
const pathOf = (id: string) => ({ operation_id: Number(id) });

export const isOver = ({ state }: Operation): boolean => state !== 'running';

/** The requests that begin an operation, by method. */
export type WorkPath<M extends Method> = {
  [P in PathOf<M>]: AnswerOf<M, P> extends Operation ? P : never;
}[PathOf<M>];

export class Operations {
  /** In order of arrival. */
  readonly all = new Store<ReadonlyMap<string, Operation>>(new Map());
  readonly #rest: Rest;
  readonly #waiting = new Map<string, ((operation: Operation) => void)[]>();

  constructor(rest: Rest) {
    this.#rest = rest;
  }

  /**
   * Takes the newest state from the live channel. Returns false if the operation had ended before: the agent may report
   * later how an operation of unknown outcome ended.
   */
  put(sent: Operation): boolean {
    const operation = operationInWords(sent);
    const known = this.all.get().get(operation.id);
    if (known && isOver(known) && (known.state !== 'timed_out' || !isOver(operation))) return false;
    const kept = new Map(this.all.get()).set(operation.id, operation);
    for (const [id, one] of kept) {
      if (kept.size <= MAX_KEPT) break;
      if (isOver(one)) kept.delete(id);
    }
    this.all.set(kept);
    if (!isOver(operation)) return true;
    const waiting = this.#waiting.get(operation.id) ?? [];
    this.#waiting.delete(operation.id);
    for (const report of waiting) report(operation);
    return true;
  }

  /** Begins it, and resolves to the operation as it begins. Raises RestError if the tower refuses. */
  start<M extends Method, P extends WorkPath<M>>(
    method: M,
    path: P,
    ...[request]: RequestArguments<M, P>
  ): Promise<Operation> {
    return this.#start(method, path, request);
  }

  async #start(method: Method, path: string, request?: LooseRequest): Promise<Operation> {
    const header = { prefer: 'respond-async' };
    const begun = (await this.#rest.send(method, path, { ...request, header })) as Operation;
    const heard = this.all.get().get(begun.id);
    // The live channel is often faster than the answer, and then newer.
    if (!heard || isOver(begun)) this.put(begun);
    return this.all.get().get(begun.id) ?? begun;
  }

  /** Begins it, and resolves to the operation as it ended, whatever its outcome. */
  async run<M extends Method, P extends WorkPath<M>>(
    method: M,
    path: P,
    ...[request]: RequestArguments<M, P>
  ): Promise<Operation> {
    return this.ended((await this.#start(method, path, request)).id);
  }

  ended(id: string): Promise<Operation> {
    const known = this.all.get().get(id);
    if (known && isOver(known)) return Promise.resolve(known);
    return new Promise((resolve) => {
      this.#waiting.set(id, [...(this.#waiting.get(id) ?? []), resolve]);
    });
  }

  /** The result still arrives: a plan that was being written is restored first. */
  async cancel(id: string): Promise<void> {
    await this.#rest.call('DELETE', '/operations/{operation_id}', { path: pathOf(id) });
  }

  /** After a break of the live channel: operations may have ended without a report. */
  async reread(): Promise<void> {
    const running = [...this.all.get().values()].filter((one) => !isOver(one));
    await Promise.all(running.map((one) => this.#reread(one)));
  }

  /** Another user signs in: running operations continue at the tower, but do not concern this user. */
  clear(): void {
    for (const one of this.all.get().values()) if (!isOver(one)) this.put({ ...one, state: 'failed', words: '' });
    this.all.set(new Map());
    this.#waiting.clear();
  }

  async #reread(operation: Operation): Promise<void> {
    try {
      this.put(await this.#rest.call('GET', '/operations/{operation_id}', { path: pathOf(operation.id) }));
    } catch (error) {
      const isForgotten = error instanceof RestError && error.status === 404;
      if (isForgotten) this.put({ ...operation, state: 'failed', words: NOBODY_KNOWS });
      // Otherwise the connection broke again: the next welcome asks again.
    }
  }
}

/** The newest operation of these kinds at a drone; null if there was none. */
export function newestOf(
  all: ReadonlyMap<string, Operation>,
  droneId: number,
  works: readonly OperationWork[],
  kind?: PlanKind,
): Operation | null {
  let newest: Operation | null = null;
  for (const one of all.values()) {
    const fits = one.drone_id === droneId && (works as readonly string[]).includes(one.work);
    if (fits && (kind === undefined || one.kind === kind)) newest = one;
  }
  return newest;
}
