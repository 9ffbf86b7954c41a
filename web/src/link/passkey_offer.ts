/**
 * Passkeys in the name field: the browser lists them and waits. Only one request can be open, so it is withdrawn while
 * the button asks, and renewed before its challenge expires.
 */

import { PasskeyError, type Asking, type PasskeyCredential, type PasskeyOptions } from './passkeys';

/** The tower keeps a challenge for five minutes. */
export const RENEW_MS = 270_000;
/** A browser that fails at once would fail again. */
const GIVES_UP_MS = 5_000;

export interface OfferParts {
  readonly options: () => Promise<PasskeyOptions>;
  readonly ask: (options: PasskeyOptions, asking: Asking) => Promise<PasskeyCredential>;
  readonly nowMs: () => number;
  readonly later: (work: () => void, ms: number) => () => void;
  /** The user picked a passkey. A rejection is the callback's own to report. */
  readonly onpicked: (credential: PasskeyCredential) => Promise<void>;
}

export class PasskeyOffer {
  readonly #parts: OfferParts;
  #open: AbortController | null = null;

  constructor(parts: OfferParts) {
    this.#parts = parts;
  }

  /** Runs until `stop`, or until the browser or the tower rejects it. */
  async run(): Promise<void> {
    const { options, ask, nowMs, later, onpicked } = this.#parts;
    this.stop();
    const mine = new AbortController();
    this.#open = mine;
    while (!mine.signal.aborted) {
      const round = new AbortController();
      const stop = (): void => round.abort();
      mine.signal.addEventListener('abort', stop);
      const cancel = later(stop, RENEW_MS);
      const beganMs = nowMs();
      try {
        const asked = await options();
        if (round.signal.aborted) continue;
        const credential = await ask(asked, { signal: round.signal, isAutofill: true });
        await onpicked(credential);
      } catch (error) {
        const isOurs = error instanceof PasskeyError && error.isWithdrawn;
        if (!isOurs && nowMs() - beganMs < GIVES_UP_MS) return;
      } finally {
        cancel();
        mine.signal.removeEventListener('abort', stop);
      }
    }
  }

  stop(): void {
    this.#open?.abort();
    this.#open = null;
  }
}
