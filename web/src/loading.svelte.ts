/** What a page reads from the tower and requests of it, with messages for progress and failure. */

export const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Data read when a page opens, and again after each change. The last data stay visible if a read fails. */
export class Loaded<T> {
  value = $state.raw<T | null>(null);
  problem = $state('');
  isLoading = $state(false);
  readonly #read: () => Promise<T>;
  #readings = 0;

  constructor(read: () => Promise<T>) {
    this.#read = read;
    void this.reload();
  }

  async reload(): Promise<void> {
    const reading = ++this.#readings;
    this.isLoading = true;
    try {
      const value = await this.#read();
      if (reading !== this.#readings) return; // a later read is in progress
      this.value = value;
      this.problem = '';
    } catch (error) {
      if (reading === this.#readings) this.problem = wordsOf(error);
    } finally {
      if (reading === this.#readings) this.isLoading = false;
    }
  }
}

/** One user request at a time. */
export class Request {
  problem = $state('');
  isBusy = $state(false);

  /** Returns true on success. */
  async run(work: () => Promise<unknown>): Promise<boolean> {
    if (this.isBusy) return false;
    this.problem = '';
    this.isBusy = true;
    try {
      await work();
      return true;
    } catch (error) {
      this.problem = wordsOf(error);
      return false;
    } finally {
      this.isBusy = false;
    }
  }
}
