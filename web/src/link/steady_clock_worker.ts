/** The worker behind `steadyClock`: answers each key after its delay. */

interface Scope {
  onmessage: ((event: { data: { key: number; delayMs: number } }) => void) | null;
  postMessage(key: number): void;
}

const scope = globalThis as unknown as Scope;
scope.onmessage = ({ data: { key, delayMs } }) => {
  setTimeout(() => scope.postMessage(key), delayMs);
};
