/** Finds the layers that this tower offers. A tile file is read by ranges, with the library for its format. */

import { addProtocol } from 'maplibre-gl';
import type { Protocol, Source } from 'pmtiles';

import type { Rest } from '../link/rest';
import { MISSING_TILE, UNREACHED_TILE } from './map_errors';
import type { MapLayer } from './map_layers';

export interface Found {
  readonly layers: readonly MapLayer[];
  /** Names of layers whose file could not be opened. */
  readonly unusable: readonly string[];
}

/** Empty if the map is the coastline alone. Raises RestError. */
export async function readLayers(rest: Rest): Promise<Found> {
  const said = (await rest.call('GET', '/map')).layers;
  const layers: MapLayer[] = [];
  const unusable: string[] = [];
  for (const { id, name, role, kind, source, url, tile_size, max_zoom, attribution } of said) {
    const layer = { id, name, role, kind, source, tileSize: tile_size, maxZoom: max_zoom, attribution };
    const whole = absolute(url);
    try {
      layers.push({ ...layer, url: whole, parts: source === 'file' ? await openFile(whole, kind) : [] });
    } catch {
      unusable.push(name);
    }
  }
  return { layers, unusable };
}

/** Braces stay as they are: the map fills them in. */
const absolute = (url: string): string => (url.startsWith('/') ? new URL(document.baseURI).origin + url : url);

let protocol: Promise<Protocol> | null = null;

async function pmtiles(): Promise<Protocol> {
  const library = await import('pmtiles');
  const made = new library.Protocol();
  addProtocol('pmtiles', async (request, abort) => {
    const { data } = await made.tilev4(request, abort);
    if (data === null || data === undefined) throw new Error(MISSING_TILE);
    return { data: data as Uint8Array };
  });
  return made;
}

/** A fetch that reaches nothing raises a TypeError, whose words differ from browser to browser. */
export const reached = (source: Source): Source => ({
  getKey: () => source.getKey(),
  async getBytes(...asked) {
    try {
      return await source.getBytes(...asked);
    } catch (error) {
      throw error instanceof TypeError ? new Error(UNREACHED_TILE, { cause: error }) : error;
    }
  },
});

/** Registers the file with the map. Returns the names of its vector layers. */
async function openFile(url: string, kind: 'raster' | 'vector'): Promise<readonly string[]> {
  const opened = await (protocol ??= pmtiles());
  const { FetchSource, PMTiles } = await import('pmtiles');
  let file = opened.get(url);
  if (!file) opened.add((file = new PMTiles(reached(new FetchSource(url)))));
  if (kind === 'raster') {
    await file.getHeader();
    return [];
  }
  const { vector_layers: layers } = (await file.getMetadata()) as { vector_layers?: readonly { id: string }[] };
  return (layers ?? []).map(({ id }) => id);
}
