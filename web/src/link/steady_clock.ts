/**
 * A clock whose `after` runs in a worker: browsers that save power stretch a page's timers (Safari to 30 ms) but not a
 * worker's. The page's own timer runs too, a little later, in case the worker does not answer.
 */

import type { Clock } from './clock';

/** The part of Worker in use. */
export interface TickWorker {
  postMessage(message: { readonly key: number; readonly delayMs: number }): void;
  onmessage: ((event: { data: number }) => void) | null;
}

const NET_AFTER_MS = 25;

export function steadyClock(page: Clock, openWorker: () => TickWorker): Clock {
  let worker: TickWorker;
  const due = new Map<number, () => void>();
  let keys = 0;
  try {
    worker = openWorker();
  } catch {
    return page;
  }
  worker.onmessage = ({ data }) => due.get(data)?.();
  return {
    nowMs: () => page.nowMs(),
    monotonicMs: () => page.monotonicMs(),
    after(delayMs, callback) {
      const key = ++keys;
      const cancel = (): void => {
        due.delete(key);
        cancelNet();
      };
      const fire = (): void => {
        cancel();
        callback();
      };
      const cancelNet = page.after(delayMs + NET_AFTER_MS, fire);
      due.set(key, fire);
      worker.postMessage({ key, delayMs });
      return cancel;
    },
  };
}
