/**
 * What the service worker keeps, and where it answers from. It exists for the times without a network: it keeps the
 * files of the console, and nothing that the tower says. No API, no live data, no map tiles, nothing that depends on who
 * is signed in.
 */

/** How many versions of the console are kept: a page of the last one, still open and flying, must find its parts. */
export const VERSIONS_KEPT = 2;
const PREFIX = 'console-';

/**
 * - `page`: from the tower; its kept copy when the tower cannot be reached.
 * - `kept`: the kept copy; from the tower where there is none.
 * - `leave`: none of our business; the browser does as if we were not there.
 */
export type Way = 'page' | 'kept' | 'leave';

export interface Asked {
  readonly method: string;
  readonly mode: string;
  readonly url: string;
}

/** `scope`: the address that the console is below; `files`: what is kept, relative to it. */
export function wayOf(asked: Asked, scope: string, files: ReadonlySet<string>): Way {
  if (asked.method !== 'GET' || !asked.url.startsWith(scope)) return 'leave';
  const { pathname } = new URL(asked.url);
  const path = pathname.slice(new URL(scope).pathname.length);
  if (path === 'api' || path.startsWith('api/') || path === 'metrics') return 'leave';
  if (asked.mode === 'navigate') return path.includes('.') && path !== 'index.html' ? 'leave' : 'page';
  // A part with a hash in its name may be of the version before.
  return files.has(path) || path.startsWith('assets/') ? 'kept' : 'leave';
}

/** A hash in the name: the same name is the same file for ever. */
export const isHashed = (path: string): boolean => path.startsWith('assets/');

/** A catalogue of a language: not for everybody, so it is kept when the first page asks for it. */
export const isCatalogue = (path: string): boolean => /^assets\/portuguese(_labels)?-[^/]*\.js$/.test(path);

export const cacheOf = (version: string): string => PREFIX + version;

/** `names`: of all caches, the oldest first, as the browser gives them. Says which of ours have had their day. */
export function outdated(names: readonly string[], version: string): string[] {
  const others = names.filter((name) => name.startsWith(PREFIX) && name !== cacheOf(version));
  return others.slice(0, Math.max(0, others.length - (VERSIONS_KEPT - 1)));
}

/** Whether the tower, or the proxy before it, is there but not at work. */
export const isDown = (status: number): boolean => status === 502 || status === 503 || status === 504;
