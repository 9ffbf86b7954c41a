/**
 * Asks the tower about something that the user is changing: a moment after the last change, one question at a time, and
 * only the answer to the newest one counts.
 */

import type { Clock } from './clock';

/** As long as a hand rests between two changes. */
export const ASK_AFTER_MS = 600;

export type Told<A> = { readonly answer: A } | { readonly problem: string };

export class LatestQuestion<Q, A> {
  readonly #clock: Clock;
  readonly #ask: (question: Q) => Promise<A>;
  readonly #tell: (told: Told<A> | null) => void;
  #cancel = (): void => undefined;
  #number = 0;
  #isAsking = false;
  /** The one to ask when the present one is answered. */
  #next: (() => void) | null = null;

  /** `tell` gets null when there is no question. */
  constructor(clock: Clock, ask: (question: Q) => Promise<A>, tell: (told: Told<A> | null) => void) {
    this.#clock = clock;
    this.#ask = ask;
    this.#tell = tell;
  }

  put(question: Q | null): void {
    this.#cancel();
    this.#next = null;
    const number = ++this.#number;
    if (question === null) this.#tell(null);
    else this.#cancel = this.#clock.after(ASK_AFTER_MS, () => this.#begin(question, number));
  }

  /** Nothing is told any more. */
  stop(): void {
    this.#cancel();
    this.#next = null;
    this.#number += 1;
  }

  #begin(question: Q, number: number): void {
    if (this.#isAsking) this.#next = () => this.#begin(question, number);
    else void this.#carryOut(question, number);
  }

  async #carryOut(question: Q, number: number): Promise<void> {
    this.#isAsking = true;
    let told: Told<A>;
    try {
      told = { answer: await this.#ask(question) };
    } catch (error) {
      told = { problem: error instanceof Error ? error.message : String(error) };
    }
    this.#isAsking = false;
    if (number === this.#number) this.#tell(told);
    const next = this.#next;
    this.#next = null;
    next?.();
  }
}
