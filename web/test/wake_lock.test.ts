import { expect, it } from 'vitest';

import { WakeLock } from '../src/wake_lock';
import { settled } from './link/fakes';

class FakeLocks {
  held = 0;
  isRefused = false;

  request(): Promise<{ release(): Promise<void> }> {
    if (this.isRefused) return Promise.reject(new Error('the page is hidden'));
    this.held++;
    return Promise.resolve({
      release: () => {
        this.held--;
        return Promise.resolve();
      },
    });
  }
}

it('holds the screen while one flies, once', async () => {
  const locks = new FakeLocks();
  const lock = new WakeLock(locks);
  for (const isWanted of [true, true]) lock.want(isWanted);
  await settled();
  expect(locks.held).toBe(1);
  await lock.renew();
  expect(locks.held, 'the page was hidden meanwhile').toBe(1);
  lock.want(false);
  await settled();
  expect(locks.held).toBe(0);
});

it('lets go of a lock that comes too late', async () => {
  const locks = new FakeLocks();
  const lock = new WakeLock(locks);
  lock.want(true);
  lock.want(false);
  await settled();
  expect(locks.held).toBe(0);
});

it('does without where the browser has none or refuses', async () => {
  const locks = new FakeLocks();
  locks.isRefused = true;
  for (const source of [undefined, locks]) new WakeLock(source).want(true);
  await settled();
  expect(locks.held).toBe(0);
});
