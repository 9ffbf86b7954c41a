import { expect, it } from 'vitest';

import { steadyClock, type TickWorker } from '../../src/link/steady_clock';
import { FakeClock } from './fakes';

class FakeWorker implements TickWorker {
  readonly asked: { key: number; delayMs: number }[] = [];
  onmessage: ((event: { data: number }) => void) | null = null;
  postMessage(message: { key: number; delayMs: number }): void {
    this.asked.push(message);
  }
}

it('is called by the worker, once, or by the page where the worker is silent', async () => {
  const [page, worker] = [new FakeClock(), new FakeWorker()];
  const clock = steadyClock(page, () => worker);
  let calls = 0;
  clock.after(20, () => calls++);
  expect(worker.asked).toEqual([{ key: 1, delayMs: 20 }]);
  worker.onmessage?.({ data: 1 });
  worker.onmessage?.({ data: 1 });
  await page.pass(1_000);
  expect(calls).toBe(1);

  clock.after(20, () => calls++);
  await page.pass(1_000);
  expect(calls).toBe(2);

  clock.after(20, () => calls++)();
  worker.onmessage?.({ data: 3 });
  await page.pass(1_000);
  expect(calls).toBe(2);
  expect(page.waiting).toBe(0);
});

it('is the page’s own where there are no workers', () => {
  const page = new FakeClock();
  const none = (): TickWorker => {
    throw new Error('not here');
  };
  expect(steadyClock(page, none)).toBe(page);
});
