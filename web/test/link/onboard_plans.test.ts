import { beforeEach, expect, it } from 'vitest';

import { OnboardPlans } from '../../src/link/onboard_plans';
import type { PlanRead, Row } from '../../src/link/mission_rest';
import type { PlanKind, PlanOnBoard } from '../../src/link/operation_types';

const WAY: readonly Row[] = [[16, 3, [0, 0, 0, null], 470000000, 80000000, 20, 1]];

interface Asked {
  readonly kind: PlanKind;
  readonly answer: (hash: string | null, items: readonly Row[] | null) => Promise<void>;
  readonly fail: (why: string) => Promise<void>;
}

let asked: Asked[];
let board: OnboardPlans;

const reported = (kind: PlanKind, hash: string | null): { [kind in PlanKind]?: PlanOnBoard } => ({
  [kind]: { kind, state: hash ? 'known' : 'unknown', hash, sent_hash: null, count: 1, fit_to_fly: true },
});
/** Waits until pending answers are processed. */
const settled = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));

beforeEach(() => {
  asked = [];
  board = new OnboardPlans(
    (kind) =>
      new Promise<PlanRead>((resolve, reject) => {
        asked.push({
          kind,
          answer(hash, items) {
            resolve({ ...reported(kind, hash)[kind]!, items, read_at: null });
            return settled();
          },
          fail(why) {
            reject(new Error(why));
            return settled();
          },
        });
      }),
  );
});

it('reads each plan that is on board once', async () => {
  board.update(reported('mission', 'aa'));
  board.update(reported('mission', 'aa'));
  expect(asked.map(({ kind }) => kind)).toEqual(['mission']);
  expect(board.rows.get()).toEqual({});
  await asked[0]!.answer('aa', WAY);
  expect(board.rows.get()).toEqual({ mission: WAY });
});

it('shows nothing where nobody knows what is on board', async () => {
  board.update(reported('fence', null));
  expect(asked).toEqual([]);
  board.update(reported('fence', 'aa'));
  await asked[0]!.answer('aa', WAY);
  board.update(reported('fence', null));
  expect(board.rows.get()).toEqual({});
});

it('shows the old plan no more as soon as another is on board, and never an answer that came too late', async () => {
  board.update(reported('mission', 'aa'));
  await asked[0]!.answer('aa', WAY);
  board.update(reported('mission', 'bb'));
  expect(board.rows.get()).toEqual({});
  board.update(reported('mission', 'cc'));
  await asked[1]!.answer('bb', WAY);
  expect(board.rows.get()).toEqual({});
  await asked[2]!.answer('cc', []);
  expect(board.rows.get()).toEqual({ mission: [] });
});

it('takes no items of another plan than the one that was told', async () => {
  board.update(reported('rally', 'aa'));
  await asked[0]!.answer('bb', WAY);
  expect(board.rows.get()).toEqual({});
  board.update(reported('rally', 'bb'));
  await asked[1]!.answer('bb', WAY);
  expect(board.rows.get()).toEqual({ rally: WAY });
});

it('says what could not be read, and tries again with the next change', async () => {
  board.update(reported('mission', 'aa'));
  await asked[0]!.fail('No answer.');
  expect(board.problem.get()).toBe('The mission on board could not be read: No answer.');
  board.update({ ...reported('mission', 'aa'), ...reported('fence', 'ff') });
  expect(asked.map(({ kind }) => kind)).toEqual(['mission', 'mission', 'fence']);
  await asked[1]!.answer('aa', WAY);
  expect(board.problem.get()).toBe('');
  expect(board.rows.get()).toEqual({ mission: WAY });
});
