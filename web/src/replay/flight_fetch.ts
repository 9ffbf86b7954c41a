/** Fetches a recorded flight by ranges: the first piece is shown while the others come, and a broken one is repeated. */

import { t } from '../languages/text';

export const RANGE_BYTES = 2 * 1024 * 1024;
/** With the index of its frames this stays within what a page may take. */
export const MAX_FLIGHT_BYTES = 160 * 1024 * 1024;
const MAX_TRIES = 4;
const RETRY_MS = 500;

export type Fetch = (url: string, init: { headers: Record<string, string> }) => Promise<Response>;
export type Wait = (ms: number) => Promise<void>;

const wait: Wait = (ms) => new Promise((done) => setTimeout(done, ms));

/** An answer that will not change. */
class Refused extends Error {}

/** Calls back for each piece with the length of the whole. Raises Error with words for people. */
export async function fetchFlight(
  url: string,
  onPiece: (piece: Uint8Array<ArrayBuffer>, totalBytes: number) => void,
  fetcher: Fetch = (from, init) => fetch(from, init),
  pause: Wait = wait,
): Promise<void> {
  const range = (from: number) => fetchRange(url, from, fetcher, pause);
  let at = 0;
  let coming: Promise<[Uint8Array<ArrayBuffer>, number]> | null = range(0);
  while (coming) {
    const [piece, total]: [Uint8Array<ArrayBuffer>, number] = await coming;
    if (total > MAX_FLIGHT_BYTES) throw new Error(TOO_LARGE);
    if (piece.length === 0) return;
    at += piece.length;
    coming = at < total ? range(at) : null; // comes while this one is read
    coming?.catch(() => undefined); // heard of above, when it is its turn
    onPiece(piece, total);
  }
}

export const TOO_LARGE = t('This flight is too large to be replayed in the browser. Download it as tlog.');

async function fetchRange(
  url: string,
  at: number,
  fetcher: Fetch,
  pause: Wait,
): Promise<[Uint8Array<ArrayBuffer>, number]> {
  for (let tries = 1; ; tries++) {
    try {
      const answer = await fetcher(url, { headers: { Range: `bytes=${at}-${at + RANGE_BYTES - 1}` } });
      if (answer.status === 416) return [new Uint8Array(0), at];
      if (answer.status === 404) throw new Refused(t('There is no such flight, or it is not among those you may see.'));
      if (answer.status === 409) throw new Refused(await detailOf(answer));
      if (!answer.ok) throw new Refused(t('The tower answered {status}.', { status: answer.status }));
      const total = /\/(\d+)$/.exec(answer.headers.get('Content-Range') ?? '')?.[1];
      const piece = new Uint8Array(await answer.arrayBuffer());
      return [piece, answer.status === 206 && total !== undefined ? Number(total) : piece.length];
    } catch (error) {
      if (error instanceof Refused || tries >= MAX_TRIES) throw error;
      await pause(RETRY_MS * tries);
    }
  }
}

async function detailOf(answer: Response): Promise<string> {
  try {
    const problem = (await answer.json()) as { detail?: string; title?: string };
    return problem.detail ?? problem.title ?? t('The tower refuses this flight.');
  } catch {
    return t('The tower refuses this flight.');
  }
}
