/** Sends a map file to the tower, with progress: `fetch` has none for what is sent. */

import { t } from '../languages/text';

const MEDIA_TYPE = 'application/vnd.pmtiles';

/** Small letters, digits, - and _, as the tower takes them; empty if nothing is left. */
export const mapFileName = (fileName: string): string =>
  fileName
    .toLowerCase()
    .replace(/\.pmtiles$/, '')
    .replace(/[^a-z0-9_-]+/g, '-')
    .replace(/^[-_]+|-+$/g, '')
    .slice(0, 80);

/** `onprogress`: the share sent, 0 to 1. Raises an Error with the tower's words. */
export function uploadMapFile(file: File, onprogress: (share: number) => void): Promise<void> {
  const name = mapFileName(file.name);
  if (name === '') return Promise.reject(new Error(t('The name of the file needs letters or digits.')));
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('PUT', `/api/v1/map/files/${name}`);
    request.setRequestHeader('Content-Type', MEDIA_TYPE);
    request.upload.onprogress = ({ loaded, total }) => onprogress(total > 0 ? loaded / total : 0);
    request.onerror = () => reject(new Error(t('The connection to the tower broke off.')));
    request.onload = () => {
      if (request.status === 204) resolve();
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
    return typeof detail === 'string' ? detail : '';
  } catch {
    return '';
  }
}
