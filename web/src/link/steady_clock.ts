/**
 * A clock whose `after` is kept by a worker: browsers that save power stretch the timers of a page (Safari to 30 ms)
 * but not those of a worker. The page's own timer runs along as a net, a little later, should the worker not answer.
 */

import type { Clock } from './clock';

/** The part of Worker that is used. */
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
