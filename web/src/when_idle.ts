/** Runs work that must not delay what the user waits for. */

const MAX_DELAY_MS = 3_000;
const WITHOUT_IDLE_MS = 1_000;

/** Runs `work` once the page is loaded and idle. Returns a function that cancels it. */
export function whenIdle(work: () => void): () => void {
  let isOff = false;
  const run = (): void => {
    if (!isOff) work();
  };
  const wait = (): void => {
    // Not every browser supports it.
    if ('requestIdleCallback' in window) window.requestIdleCallback(run, { timeout: MAX_DELAY_MS });
    else setTimeout(run, WITHOUT_IDLE_MS);
  };
  if (document.readyState === 'complete') wait();
  else window.addEventListener('load', wait, { once: true });
  return () => {
    isOff = true;
  };
}
