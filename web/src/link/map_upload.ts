/** Sends a map file to the tower, with progress: `fetch` has none for what is sent. */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';

const MEDIA_TYPE = 'application/vnd.pmtiles';
const ELEVATION_MEDIA_TYPE = 'image/tiff';

/** Small letters, digits, - and _, as the tower takes them; empty if nothing is left. */
export const mapFileName = (fileName: string): string =>
  fileName
    .toLowerCase()
    .replace(/\.(pmtiles|tiff?)$/, '')
    .replace(/[^a-z0-9_-]+/g, '-')
    .replace(/^[-_]+|-+$/g, '')
    .slice(0, 80);

/** `onprogress`: the share sent, 0 to 1. Raises an Error with the tower's words. */
export function uploadMapFile(file: File, onprogress: (share: number) => void): Promise<void> {
  const name = mapFileName(file.name);
  if (name === '') return Promise.reject(new Error(t('The name of the file needs letters or digits.')));
  return send(`/api/v1/map/files/${name}`, MEDIA_TYPE, file, onprogress);
}

/** Sends a GeoTIFF, of which the tower then makes a map file. Raises an Error with the tower's words. */
export function uploadElevation(file: File, attribution: string, onprogress: (share: number) => void): Promise<void> {
  const name = mapFileName(file.name);
  if (name === '') return Promise.reject(new Error(t('The name of the file needs letters or digits.')));
  const query = new URLSearchParams({ title: file.name.replace(/\.tiff?$/i, '').slice(0, 200), attribution });
  return send(`/api/v1/map/elevation/${name}?${query}`, ELEVATION_MEDIA_TYPE, file, onprogress);
}

function send(path: string, mediaType: string, file: File, onprogress: (share: number) => void): Promise<void> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('PUT', path);
    request.setRequestHeader('Content-Type', mediaType);
    request.upload.onprogress = ({ loaded, total }) => onprogress(total > 0 ? loaded / total : 0);
    request.onerror = () => reject(new Error(t('The connection to the tower broke off.')));
    request.onload = () => {
      if (request.status === 204 || request.status === 202) resolve();
      else
        reject(
          new Error(detailOf(request.responseText) || t('The tower answered {status}.', { status: request.status })),
        );
    };
    request.send(file);
  });
}

function detailOf(text: string): string {
  try {
    const { detail } = JSON.parse(text) as { detail?: unknown };
    return typeof detail === 'string' ? towerText(detail) : '';
  } catch {
    return '';
  }
}
