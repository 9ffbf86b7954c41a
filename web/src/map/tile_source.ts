/** Finds the tiles that this tower configures. A tile file is read by ranges, with the library for its format. */

import { addProtocol } from 'maplibre-gl';

import type { Rest } from '../link/rest';
import type { Tiles } from './tile_layers';

/** Null if the map is the coastline alone. Raises RestError, or the error of the file. */
export async function readTiles(rest: Rest): Promise<Tiles | null> {
  const said = await rest.call('GET', '/map');
  if (said.tiles === 'none' || said.kind === null) return null;
  const { tiles: from, kind, most_zoom: mostZoom, attribution } = said;
  if (from === 'addresses') return { from, kind, url: said.url, mostZoom, attribution, layers: [] };
  const url = new URL(said.url, document.baseURI).href;
  return { from, kind, url, mostZoom, attribution, layers: await openFile(url, kind) };
}

/** Registers the file with the map. Returns the names of its vector layers. */
async function openFile(url: string, kind: 'raster' | 'vector'): Promise<readonly string[]> {
  const { PMTiles, Protocol } = await import('pmtiles');
  const protocol = new Protocol();
  addProtocol('pmtiles', protocol.tile);
  const file = new PMTiles(url);
  protocol.add(file);
  if (kind === 'raster') return [];
  const { vector_layers: layers } = (await file.getMetadata()) as { vector_layers?: readonly { id: string }[] };
  return (layers ?? []).map(({ id }) => id);
}
