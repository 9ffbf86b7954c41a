/** Loads elevation tiles of one layer of the tower: from a PMTiles file by ranges, or one by one. */

import type { PMTiles } from 'pmtiles';

import { t } from '../languages/text';
import { decodeTerrarium, type HeightTile } from './height_tiles';

export interface ElevationLayer {
  readonly source: 'file' | 'addresses';
  /** Absolute. */
  readonly url: string;
  readonly maxZoom: number | null;
}

const SIDES = [256, 512];
const USUAL_MAX_ZOOM = 14;

export class ElevationSource {
  readonly zoom: number;
  readonly #file: PMTiles | null;
  readonly #url: string;

  private constructor(zoom: number, file: PMTiles | null, url: string) {
    this.zoom = zoom;
    this.#file = file;
    this.#url = url;
  }

  /** Raises if the layer cannot be read. */
  static async open({ source, url, maxZoom }: ElevationLayer): Promise<ElevationSource> {
    if (source === 'addresses') return new ElevationSource(maxZoom ?? USUAL_MAX_ZOOM, null, url);
    const { PMTiles, ResolvedValueCache } = await import('pmtiles');
    // The usual cache keeps what failed to load too: a list of tiles that failed once would fail without end.
    const file = new PMTiles(url, new ResolvedValueCache());
    return new ElevationSource((await file.getHeader()).maxZoom, file, url);
  }

  /** Null: there is no such tile. Raises if it cannot be loaded now. */
  async tile(x: number, y: number): Promise<HeightTile | null> {
    const image = this.#file ? await this.#fromFile(this.#file, x, y) : await this.#fromAddress(x, y);
    return image && (await decoded(image));
  }

  async #fromFile(file: PMTiles, x: number, y: number): Promise<Blob | null> {
    const found = await file.getZxy(this.zoom, x, y);
    return found ? new Blob([found.data]) : null;
  }

  async #fromAddress(x: number, y: number): Promise<Blob | null> {
    const url = this.#url.replace('{z}', `${this.zoom}`).replace('{x}', `${x}`).replace('{y}', `${y}`);
    const answer = await fetch(url);
    if (answer.status === 404 || answer.status === 204) return null;
    if (!answer.ok) throw new Error(t('The tower answered {status}', { status: answer.status }));
    return answer.blob();
  }
}

async function decoded(image: Blob): Promise<HeightTile | null> {
  // The numbers in the image are not colours: nothing may convert them.
  const bitmap = await createImageBitmap(image, { colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
  const { width, height } = bitmap;
  if (width !== height || !SIDES.includes(width)) return null;
  const pen = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true })!;
  pen.drawImage(bitmap, 0, 0);
  bitmap.close();
  return decodeTerrarium(pen.getImageData(0, 0, width, height).data, width);
}
