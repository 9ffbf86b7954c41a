/** Transfers plans to and from a drone: one kind after another, each an operation of the tower, with its outcome. */

import { t } from '../../languages/text';
import type { MissionRest, PlanForeseen } from '../../link/mission_rest';
import type { Operation } from '../../link/operation_types';
import type { Operations } from '../../link/operations';
import { RestError } from '../../link/rest';
import { wordsOf } from '../../loading.svelte';
import { replacePlan } from '../../plan/edits';
import type { Plan, PlanKind } from '../../plan/plan_types';
import { itemOfRow, itemsOf, rowOf, withItems } from '../../plan/wire_items';
import type { PlanWorkspace } from './plan_workspace.svelte';

export const KIND_WORDS: Record<PlanKind, string> = {
  mission: t('mission'),
  fence: t('fence'),
  rally: t('rally points'),
};

/** How the last transfer ended. `item`: the first one that the autopilot refused, from 0. */
export type TransferOutcome =
  | { readonly as: 'done'; readonly words: string }
  | { readonly as: 'failed'; readonly words: string; readonly kind: PlanKind; readonly item: number | null };

export type Foreseen = PlanForeseen & { readonly kind: PlanKind };

export interface Ways {
  readonly droneId: number;
  readonly name: string;
  readonly rest: MissionRest;
  readonly operations: Operations;
}

export class Transfer {
  /** The current activity, in words; empty: none. */
  doing = $state('');
  operation = $state.raw<Operation | null>(null);
  outcome = $state.raw<TransferOutcome | null>(null);
  isCancelling = $state(false);
  readonly #workspace: PlanWorkspace;
  readonly #ways: Ways;

  constructor(workspace: PlanWorkspace, ways: Ways) {
    this.#workspace = workspace;
    this.#ways = ways;
  }

  get isBusy(): boolean {
    return this.doing !== '';
  }

  upload(kinds: readonly PlanKind[], whileFlying: boolean): Promise<void> {
    const { plan } = this.#workspace;
    const { rest, droneId, name } = this.#ways;
    return this.#each(kinds, t('to {name}', { name }), (kind) =>
      rest.upload(droneId, kind, itemsOf(plan, kind).map(rowOf), whileFlying),
    );
  }

  /** What the drone's autopilot would change in these. Omits kinds for which that is unknown. */
  async foresee(kinds: readonly PlanKind[]): Promise<Foreseen[]> {
    const { plan } = this.#workspace;
    const { rest, droneId } = this.#ways;
    const asked = kinds.map(async (kind): Promise<Foreseen[]> => {
      try {
        return [{ kind, ...(await rest.foresee(droneId, kind, itemsOf(plan, kind).map(rowOf))) }];
      } catch {
        return []; // no heartbeat yet, or an older tower: the upload itself reports changes
      }
    });
    return (await Promise.all(asked)).flat();
  }

  verify(kinds: readonly PlanKind[]): Promise<void> {
    const { plan } = this.#workspace;
    const { rest, droneId, name } = this.#ways;
    return this.#each(kinds, t('compared with {name}', { name }), (kind) =>
      rest.verify(droneId, kind, itemsOf(plan, kind).map(rowOf)),
    );
  }

  clear(kinds: readonly PlanKind[], whileFlying: boolean): Promise<void> {
    const { rest, droneId, name } = this.#ways;
    return this.#each(kinds, t('cleared on {name}', { name }), (kind) => rest.clear(droneId, kind, whileFlying));
  }

  /** Replaces the plan on the screen by the drone's, as one undo step. */
  async download(kinds: readonly PlanKind[]): Promise<void> {
    if (this.isBusy) return;
    this.outcome = null;
    const { rest, droneId, name } = this.#ways;
    const dropped: string[] = [];
    let after: Plan = this.#workspace.plan;
    let kind: PlanKind = 'mission';
    const follow = this.#ways.operations.all.subscribe((all) => {
      const newest = [...all.values()].findLast((one) => one.drone_id === droneId && one.work === 'plan_download');
      if (newest && this.doing !== '') this.operation = newest.state === 'running' ? newest : null;
    });
    try {
      for (kind of kinds) {
        this.doing = t('{kind} read from {name}', { kind: KIND_WORDS[kind], name });
        const read = await rest.plan(droneId, kind, true);
        const rows = read.items ?? [];
        const part = withItems(
          after,
          kind,
          rows.map((row, at) => itemOfRow(row, t('Item {at} of the {kind}', { at: at + 1, kind }))),
        );
        after = part.plan;
        dropped.push(...part.dropped);
      }
      this.#workspace.apply(replacePlan(t('Read from {name}', { name }), after));
      this.#workspace.shows += 1;
      const words = [t('What is on {name} is on the screen.', { name }), ...dropped].join(' ');
      this.outcome = { as: 'done', words };
    } catch (error) {
      this.outcome = { as: 'failed', words: wordsOf(error), kind, item: null };
    } finally {
      follow();
      this.doing = '';
      this.operation = null;
    }
  }

  /** The answer still arrives: a plan that was being written is restored first. */
  async cancel(): Promise<void> {
    if (!this.operation || this.isCancelling) return;
    this.isCancelling = true;
    try {
      await this.#ways.operations.cancel(this.operation.id);
    } catch (error) {
      this.isCancelling = false;
      this.outcome = { as: 'failed', words: wordsOf(error), kind: this.operation.kind ?? 'mission', item: null };
    }
  }

  /** Stops at the first failure. */
  async #each(
    kinds: readonly PlanKind[],
    whither: string,
    begin: (kind: PlanKind) => Promise<Operation>,
  ): Promise<void> {
    if (this.isBusy) return;
    this.outcome = null;
    const words: string[] = [];
    let now: PlanKind = 'mission';
    try {
      for (const [at, kind] of kinds.entries()) {
        now = kind;
        const which = kinds.length > 1 ? ` ${t('({at} of {kinds})', { at: at + 1, kinds: kinds.length })}` : '';
        this.doing = `${KIND_WORDS[kind]} ${whither}${which}`;
        const ended = await this.#follow(await begin(kind));
        if (ended.state !== 'done') {
          this.outcome = { as: 'failed', words: failedWords(ended), kind, item: ended.item };
          return;
        }
        if (ended.words) words.push(ended.words);
      }
      this.outcome = { as: 'done', words: words.join(' ') || t('Done.') };
    } catch (error) {
      const item = error instanceof RestError ? error.item : null;
      this.outcome = { as: 'failed', words: wordsOf(error), kind: now, item };
    } finally {
      this.doing = '';
      this.operation = null;
      this.isCancelling = false;
    }
  }

  async #follow(begun: Operation): Promise<Operation> {
    this.operation = begun;
    const { operations } = this.#ways;
    const stop = operations.all.subscribe((all) => (this.operation = all.get(begun.id) ?? this.operation));
    try {
      return await operations.ended(begun.id);
    } finally {
      stop();
    }
  }
}

function failedWords({ words, state, code }: Operation): string {
  if (words) return words;
  return t('It ended as {state}{what}.', { state: state.replace('_', ' '), what: code ? ` (${code})` : '' });
}
