/** Time for the link layer, injected so that tests control it. */

export interface Clock {
  nowMs(): number;
  /** Never set back or forward, unlike `nowMs`; its origin is arbitrary. */
  monotonicMs(): number;
  /** Calls back once after `delayMs`; the returned function cancels. */
  after(delayMs: number, callback: () => void): () => void;
}

export const realClock: Clock = {
  nowMs: () => Date.now(),
  monotonicMs: () => performance.now(),
  after(delayMs, callback) {
    const handle = setTimeout(callback, delayMs);
    return () => clearTimeout(handle);
  },
};
