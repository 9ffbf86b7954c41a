/**
 * What is loaded of the tiles of a grid, the oldest forgotten first. A tile that failed to load is asked for again: what
 * waits for it would wait without end otherwise. Knows nothing of what a tile holds.
 */

export const AGAIN_MS = 5_000;

export class LoadedTiles<Tile> {
  readonly #load: (x: number, y: number) => Promise<Tile | null>;
  readonly #changed: () => void;
  readonly #maxTiles: number;
  /** Undefined: asked for. */
  readonly #tiles = new Map<string, Tile | null | undefined>();

  /**
   * @param load null: there is no such tile. Raises if it cannot be loaded now.
   * @param changed called after a tile has come, and when a failed one may be asked for again.
   */
  constructor(load: (x: number, y: number) => Promise<Tile | null>, changed: () => void, maxTiles: number) {
    this.#load = load;
    this.#changed = changed;
    this.#maxTiles = maxTiles;
  }

  /** Null: there is no such tile; undefined: not loaded yet, and asked for by this. */
  at(x: number, y: number): Tile | null | undefined {
    const key = `${x}/${y}`;
    if (this.#tiles.has(key)) return this.#tiles.get(key);
    this.#tiles.set(key, undefined);
    void this.#ask(key, x, y);
    return undefined;
  }

  async #ask(key: string, x: number, y: number): Promise<void> {
    try {
      this.#tiles.set(key, await this.#load(x, y));
    } catch {
      setTimeout(() => {
        this.#tiles.delete(key);
        this.#changed();
      }, AGAIN_MS);
      return;
    }
    for (const oldest of this.#tiles.keys()) {
      if (this.#tiles.size <= this.#maxTiles) break;
      this.#tiles.delete(oldest);
    }
    this.#changed();
  }
}
