/**
 * The height of the ground, as the tower's elevation has it. Answers at once from loaded tiles, and loads what is asked
 * for; whoever reads it in an effect or a derived value is called again when more has come.
 */

import type { Place } from '../link/messages';
import type { Rest } from '../link/rest';
import { latDegOf, lonDegOf, type Spot } from '../plan/plan_types';
import { ElevationSource } from './elevation_source';
import { heightAt, type GroundHeight, type HeightTile } from './height_tiles';
import { AGAIN_MS, LoadedTiles } from './loaded_tiles';

/** Each takes 260 kB, or 1 MB at 512 pixels. */
const MAX_TILES = 64;

export class Ground {
  #revision = $state(0);
  #source: { readonly zoom: number; readonly tiles: LoadedTiles<HeightTile> } | null | undefined = undefined;
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
    return heightAt(place, source.zoom, (x, y) => source.tiles.at(x, y));
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
        const source = await ElevationSource.open({ source: layer.source, url, maxZoom: layer.max_zoom });
        const changed = (): void => void (this.#revision += 1);
        this.#source = { zoom: source.zoom, tiles: new LoadedTiles((x, y) => source.tile(x, y), changed, MAX_TILES) };
      } else this.#source = null;
      this.#revision += 1;
    } catch {
      setTimeout(() => void this.#open(), AGAIN_MS);
    }
  }
}
