/**
 * The height of the ground, as the tower's elevation has it. Answers at once from loaded tiles, and loads what is asked
 * for; whoever reads it in an effect or a derived value is called again when more has come.
 */

import type { Place } from '../link/messages';
import type { Rest } from '../link/rest';
import { latDegOf, lonDegOf, type Spot } from '../plan/plan_types';
import { ElevationSource } from './elevation_source';
import { heightAt, type GroundHeight, type HeightTile } from './height_tiles';

/** Each takes 260 kB, or 1 MB at 512 pixels. */
const MAX_TILES = 64;
const AGAIN_MS = 30_000;

export class Ground {
  #revision = $state(0);
  #source: ElevationSource | null | undefined = undefined;
  readonly #tiles = new Map<string, HeightTile | null | undefined>();
  readonly #rest: Rest;

  constructor(rest: Rest) {
    this.#rest = rest;
    void this.#open();
  }

  /** Whether this tower has any elevation; undefined: not known yet. */
  get isThere(): boolean | undefined {
    void this.#revision;
    return this.#source === undefined ? undefined : this.#source !== null;
  }

  heightM(place: Place): GroundHeight {
    void this.#revision;
    const source = this.#source;
    if (!source) return source;
    return heightAt(place, source.zoom, (x, y) => this.#tileAt(source, x, y));
  }

  /** As a value of its own for each state of what is loaded: a derived value depends on it. */
  readonly at = $derived.by((): ((spot: Spot) => GroundHeight) => {
    void this.#revision;
    return (spot) => this.heightM({ latDeg: latDegOf(spot), lonDeg: lonDegOf(spot) });
  });

  async #open(): Promise<void> {
    try {
      const { layers } = await this.#rest.call('GET', '/map');
      const layer = layers.find(({ role }) => role === 'terrain');
      if (layer) {
        const url = layer.url.startsWith('/') ? new URL(document.baseURI).origin + layer.url : layer.url;
        this.#source = await ElevationSource.open({ source: layer.source, url, maxZoom: layer.max_zoom });
      } else this.#source = null;
      this.#revision += 1;
    } catch {
      setTimeout(() => void this.#open(), AGAIN_MS);
    }
  }

  #tileAt(source: ElevationSource, x: number, y: number): HeightTile | null | undefined {
    const key = `${x}/${y}`;
    if (this.#tiles.has(key)) return this.#tiles.get(key);
    this.#tiles.set(key, undefined);
    void this.#load(source, key, x, y);
    return undefined;
  }

  async #load(source: ElevationSource, key: string, x: number, y: number): Promise<void> {
    try {
      this.#tiles.set(key, await source.tile(x, y));
      for (const oldest of this.#tiles.keys()) {
        if (this.#tiles.size <= MAX_TILES) break;
        this.#tiles.delete(oldest);
      }
      this.#revision += 1;
    } catch {
      setTimeout(() => this.#tiles.delete(key), AGAIN_MS);
    }
  }
}
