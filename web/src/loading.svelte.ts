/** What a page reads from the tower and what it asks of it, with the words that it shows meanwhile and after a failure. */

export const wordsOf = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Something that is read when a page opens, and again after each change. What was read stays in sight if that fails. */
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
      if (reading !== this.#readings) return; // a later one is on its way
      this.value = value;
      this.problem = '';
    } catch (error) {
      if (reading === this.#readings) this.problem = wordsOf(error);
    } finally {
      if (reading === this.#readings) this.isLoading = false;
    }
  }
}

/** One request at a time that the user asked for. */
export class Request {
  problem = $state('');
  isBusy = $state(false);

  /** True when it was done. */
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
