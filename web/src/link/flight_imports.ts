/** Flights from files of other programs: uploaded to the tower, converted there, and replayed like recorded ones. */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import type { Rest } from './rest';
import type { Schemas } from './rest_types';

export type ImportedFlight = Schemas['ImportedFlightView'];

/** A flight of the tower in addresses of the console: `12` is recorded, `import-0123456789abcdef` imported. */
export type FlightKey = `${number}` | `import-${string}`;

const PATH = '/api/v1/flight-imports';
const PREFIX = 'import-';
export const IMPORTED_FILES = '.tlog,.rlog,.bin,.ulg';

export const importKey = (importId: string): FlightKey => `${PREFIX}${importId}`;
/** Null: a recorded flight. */
export const importIdOf = (flight: FlightKey): string | null =>
  flight.startsWith(PREFIX) ? flight.slice(PREFIX.length) : null;
export const importFileHref = (importId: string): string => `${PATH}/${importId}/tlog`;

export const readImports = (rest: Rest): Promise<readonly ImportedFlight[]> => rest.call('GET', '/flight-imports');
export const deleteImport = (rest: Rest, importId: string): Promise<unknown> =>
  rest.call('DELETE', '/flight-imports/{import_id}', { path: { import_id: importId } });

/**
 * `onprogress`: the share sent, 0 to 1; after that the tower converts the file. Raises an Error with the tower's words.
 */
export function importFlight(file: File, onprogress: (share: number) => void): Promise<ImportedFlight> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest(); // `fetch` has no progress for what is sent
    request.open('POST', `${PATH}?name=${encodeURIComponent(file.name)}`);
    request.setRequestHeader('Content-Type', 'application/octet-stream');
    request.upload.onprogress = ({ loaded, total }) => onprogress(total > 0 ? loaded / total : 0);
    request.onerror = () => reject(new Error(t('The connection to the tower broke off.')));
    request.onload = () => {
      const answer = parsed(request.responseText);
      if (request.status === 201) resolve(answer as unknown as ImportedFlight);
      else reject(new Error(wordsIn(answer) || t('The tower answered {status}.', { status: request.status })));
    };
    request.send(file);
  });
}

function parsed(text: string): Record<string, unknown> {
  try {
    return JSON.parse(text) as Record<string, unknown>;
  } catch {
    return {};
  }
}

function wordsIn({ detail }: Record<string, unknown>): string {
  if (typeof detail !== 'string' || detail === '') return '';
  const words = towerText(detail);
  return `${words[0]!.toUpperCase()}${words.slice(1)}.`;
}
