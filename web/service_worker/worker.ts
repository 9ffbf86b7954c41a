/**
 * The service worker: keeps the console for times without a network (rules.ts says what). A new version takes over the
 * keeping at once and reloads nobody: pages are told of it and say so; when to load it is their people's decision.
 */

import { cacheOf, isCatalogue, isDown, isHashed, outdated, wayOf } from './rules';

/** Put in by scripts/build_service_worker.mjs. */
declare const __VERSION__: string;
declare const __ENTRY__: string;
declare const __FILES__: readonly string[];

declare const self: ServiceWorkerGlobalScope;

const PAGE = 'index.html';
/** A tower that does not answer the question for the page in this time is as good as none. */
const PAGE_LIMIT_MS = 6_000;
const files = new Set(__FILES__);
const pathOf = (request: Request): string => request.url.slice(self.registration.scope.length);
const addressOf = (path: string): string => new URL(path, self.registration.scope).href;
const NEWS = { type: 'console-version', entry: __ENTRY__ };

async function keep(): Promise<void> {
  const kept = await caches.open(cacheOf(__VERSION__));
  // One after the other: whoever flies over the same thin link comes first.
  for (const path of files) {
    const address = addressOf(path);
    const known = isHashed(path) ? await caches.match(address, { ignoreVary: true }) : undefined;
    const answer = known ?? (await fetch(address, { cache: isHashed(path) ? 'default' : 'no-cache' }));
    if (!answer.ok) throw new Error(`${path}: status ${answer.status}`);
    // A tower that is being renewed may give us the page of the other version. The next try will be better.
    if (path === PAGE && !(await answer.clone().text()).includes(__ENTRY__)) throw new Error('another version');
    await kept.put(address, answer);
  }
}

async function begin(): Promise<void> {
  for (const name of outdated(await caches.keys(), __VERSION__)) await caches.delete(name);
  await self.clients.claim();
  for (const client of await self.clients.matchAll({ type: 'window' })) client.postMessage(NEWS);
}

async function fromKept(request: Request | string): Promise<Response | undefined> {
  const kept = await caches.open(cacheOf(__VERSION__));
  return kept.match(request, { ignoreVary: true });
}

async function page(request: Request): Promise<Response> {
  const limit = AbortSignal.timeout(PAGE_LIMIT_MS);
  try {
    const answer = await fetch(request, { signal: limit });
    if (!isDown(answer.status)) return answer;
    return (await fromKept(addressOf(PAGE))) ?? answer;
  } catch (error) {
    const shell = await fromKept(addressOf(PAGE));
    if (shell) return shell;
    throw error;
  }
}

async function part(request: Request): Promise<Response> {
  const known = (await fromKept(request)) ?? (await olderPart(request));
  if (known) return known;
  const answer = await fetch(request);
  if (answer.ok && isCatalogue(pathOf(request))) {
    const kept = await caches.open(cacheOf(__VERSION__));
    await kept.put(request, answer.clone());
  }
  return answer;
}

/** Only what is the same for ever may come from the version before. */
async function olderPart(request: Request): Promise<Response | undefined> {
  return isHashed(pathOf(request)) ? caches.match(request, { ignoreVary: true }) : undefined;
}

self.addEventListener('install', (event) => {
  event.waitUntil(keep().then(() => self.skipWaiting()));
});

self.addEventListener('activate', (event) => {
  event.waitUntil(begin());
});

self.addEventListener('message', (event) => {
  if (event.data === 'which-version') event.source?.postMessage(NEWS);
});

self.addEventListener('fetch', (event) => {
  const { request } = event;
  const way = wayOf(request, self.registration.scope, files);
  if (way === 'page') event.respondWith(page(request));
  if (way === 'kept') event.respondWith(part(request));
});
