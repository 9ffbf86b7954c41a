import { beforeEach, describe, expect, it } from 'vitest';

import { LossChecks, TRY_AGAIN_MS } from '../../src/link/loss_checks';
import { FakeClock, settled } from './fakes';

let clock: FakeClock;
let checks: LossChecks;
let reads: number[];
let answers: ((error?: Error) => void)[];
let reported: string[];

beforeEach(() => {
  clock = new FakeClock();
  reads = [];
  answers = [];
  reported = [];
  checks = new LossChecks(clock, (droneId) => {
    reads.push(droneId);
    return new Promise((resolve, reject) => {
      answers.push((error) => (error ? reject(error) : resolve()));
    });
  });
});

const watch = (): (() => void) => checks.watch(1, (problem) => reported.push(problem));

async function answer(error?: Error): Promise<void> {
  answers.shift()!(error);
  await settled();
}

describe('the check before flight of a drone that is looked at', () => {
  it('is read at first, then whenever the tower says that it has changed, and not by time', async () => {
    watch();
    await answer();
    await clock.pass(600_000);
    expect(reads).toEqual([1]);
    checks.changed(1);
    await answer();
    checks.allChanged();
    await answer();
    expect(reads).toEqual([1, 1, 1]);
    expect(reported).toEqual(['', '', '']);
  });

  it('is read once more when it changed while it was read', async () => {
    watch();
    checks.changed(1);
    checks.changed(1);
    expect(reads).toEqual([1]);
    await answer();
    expect(reads).toEqual([1, 1]);
    await answer();
    expect(reads).toEqual([1, 1]);
    expect(reported).toEqual(['']);
  });

  it('is tried again after a failure, which is told', async () => {
    watch();
    await answer(new Error('no connection'));
    expect(reported).toEqual(['no connection']);
    await clock.pass(TRY_AGAIN_MS);
    expect(reads).toEqual([1, 1]);
    await answer();
    expect(reported).toEqual(['no connection', '']);
    expect(clock.waiting).toBe(0);
  });

  it('is left alone when nobody looks any more, or never did', async () => {
    checks.changed(2);
    const end = watch();
    const endToo = watch();
    await answer(new Error('no connection'));
    end();
    expect(clock.waiting).toBe(1);
    endToo();
    expect(clock.waiting).toBe(0);
    checks.changed(1);
    checks.allChanged();
    expect(reads).toEqual([1]);
  });

  it('tells nothing of a reading that nobody waits for', async () => {
    const end = watch();
    end();
    await answer(new Error('late'));
    expect(reported).toEqual([]);
    expect(clock.waiting).toBe(0);
  });
});
