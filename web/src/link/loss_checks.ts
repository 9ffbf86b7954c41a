/**
 * Keeps the check before flight current for drones that are on view. The tower reports changes, so it is read then and
 * after each reconnection; only a failed read is retried by time.
 */

import type { Clock } from './clock';

export const TRY_AGAIN_MS = 5_000;

type Reported = (problem: string) => void;

interface Watched {
  readonly reporters: Set<Reported>;
  isReading: boolean;
  /** It changed during the read. */
  isOld: boolean;
  cancelRetry: () => void;
}

export class LossChecks {
  readonly #clock: Clock;
  readonly #read: (droneId: number) => Promise<void>;
  readonly #watched = new Map<number, Watched>();

  constructor(clock: Clock, read: (droneId: number) => Promise<void>) {
    this.#clock = clock;
    this.#read = read;
  }

  /** Keeps it current from now on. `told` receives the error, or an empty string. Returns a function that stops it. */
  watch(droneId: number, reported: Reported): () => void {
    const watched = this.#watched.get(droneId) ?? {
      reporters: new Set<Reported>(),
      isReading: false,
      isOld: false,
      cancelRetry: () => undefined,
    };
    watched.reporters.add(reported);
    this.#watched.set(droneId, watched);
    this.changed(droneId);
    return () => {
      watched.reporters.delete(reported);
      if (watched.reporters.size > 0) return;
      watched.cancelRetry();
      this.#watched.delete(droneId);
    };
  }

  /** The tower reports that the check has changed. */
  changed(droneId: number): void {
    const watched = this.#watched.get(droneId);
    if (!watched) return;
    watched.isOld = true;
    if (!watched.isReading) void this.#readUntilNew(droneId, watched);
  }

  /** A change may have been missed. */
  allChanged(): void {
    for (const droneId of this.#watched.keys()) this.changed(droneId);
  }

  async #readUntilNew(droneId: number, watched: Watched): Promise<void> {
    watched.isReading = true;
    let problem = '';
    while (watched.isOld && problem === '') {
      watched.isOld = false;
      try {
        await this.#read(droneId);
      } catch (error) {
        problem = error instanceof Error ? error.message : String(error);
      }
    }
    watched.isReading = false;
    watched.cancelRetry();
    if (this.#watched.get(droneId) !== watched) return;
    if (problem) watched.cancelRetry = this.#clock.after(TRY_AGAIN_MS, () => this.changed(droneId));
    for (const reported of watched.reporters) reported(problem);
  }
}
