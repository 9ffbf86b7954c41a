import { beforeEach, describe, expect, it } from 'vitest';

import { ASK_AFTER_MS, LatestQuestion, type Told } from '../../src/link/latest_question';
import { FakeClock, settled } from './fakes';

interface Asked {
  readonly question: string;
  readonly answer: (answer: string) => Promise<void>;
  readonly fail: (why: string) => Promise<void>;
}

let clock: FakeClock;
let asked: Asked[];
let told: (Told<string> | null)[];
let latest: LatestQuestion<string, string>;

beforeEach(() => {
  clock = new FakeClock();
  asked = [];
  told = [];
  latest = new LatestQuestion(
    clock,
    (question) =>
      new Promise((resolve, reject) => {
        asked.push({
          question,
          answer: (answer) => (resolve(answer), settled()),
          fail: (why) => (reject(new Error(why)), settled()),
        });
      }),
    (one) => told.push(one),
  );
});

const questions = (): string[] => asked.map(({ question }) => question);

describe('a question about what is being changed', () => {
  it('is asked once the hand rests', async () => {
    latest.put('a');
    await clock.pass(ASK_AFTER_MS - 1);
    latest.put('b');
    await clock.pass(ASK_AFTER_MS - 1);
    expect(questions()).toEqual([]);
    await clock.pass(1);
    expect(questions()).toEqual(['b']);
    await asked[0]!.answer('yes');
    expect(told).toEqual([{ answer: 'yes' }]);
  });

  it('is asked one at a time, and only the newest answer counts', async () => {
    for (const question of ['a', 'b', 'c']) {
      latest.put(question);
      await clock.pass(ASK_AFTER_MS);
    }
    expect(questions()).toEqual(['a']);
    await asked[0]!.answer('of the first');
    expect(questions()).toEqual(['a', 'c']);
    expect(told).toEqual([]);
    await asked[1]!.fail('no heartbeat');
    expect(told).toEqual([{ problem: 'no heartbeat' }]);
  });

  it('is taken back', async () => {
    latest.put('a');
    await clock.pass(ASK_AFTER_MS);
    latest.put(null);
    expect(told).toEqual([null]);
    await asked[0]!.answer('too late');
    latest.put('b');
    latest.stop();
    await clock.pass(ASK_AFTER_MS);
    expect(questions()).toEqual(['a']);
    expect(told).toEqual([null]);
  });
});
