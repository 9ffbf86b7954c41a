/** Keeps the screen on while it is wanted. The browser takes the lock away from a hidden page, so it is asked again. */

export interface LockSource {
  request(type: 'screen'): Promise<{ release(): Promise<void> }>;
}

export class WakeLock {
  readonly #source: LockSource | undefined;
  #isWanted = false;
  #lock: { release(): Promise<void> } | null = null;

  constructor(source: LockSource | undefined) {
    this.#source = source;
  }

  want(isWanted: boolean): void {
    if (this.#isWanted === isWanted) return;
    this.#isWanted = isWanted;
    void this.renew();
  }

  /** Also when the page is visible again. */
  async renew(): Promise<void> {
    const held = this.#lock;
    this.#lock = null;
    await held?.release().catch(() => undefined);
    if (!this.#isWanted || !this.#source) return;
    try {
      const lock = await this.#source.request('screen');
      if (this.#isWanted && this.#lock === null) this.#lock = lock;
      else await lock.release();
    } catch {
      // The battery is low, or the page is hidden: the screen follows the system's own rule.
    }
  }
}
