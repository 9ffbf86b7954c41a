/**
 * Has the service worker keep the console for offline use, and learns from it when the tower has a newer version.
 * Nothing here reloads the page: only the user may do that, because they may be flying from it.
 */

import { tower } from './tower.svelte';
import { whenIdle } from './when_idle';

const LOOK_AGAIN_MS = 3_600_000;

/** `isOutdated`: the tower serves a different version from this page's. */
export const consoleVersion = $state({ isOutdated: false });

/** The script that started this page: its name has a hash of its content. */
const ours = document.querySelector<HTMLScriptElement>('script[type="module"][src]')?.src ?? '';

interface News {
  readonly type: 'console-version';
  readonly entry: string;
}

const isNews = (data: unknown): data is News =>
  typeof data === 'object' && data !== null && (data as Partial<News>).type === 'console-version';

export function keepConsole(): void {
  // Development has no service worker. Without https, browsers allow one on localhost only.
  if (!import.meta.env.PROD || !('serviceWorker' in navigator)) return;
  navigator.serviceWorker.addEventListener('message', ({ data }) => {
    if (isNews(data)) consoleVersion.isOutdated = !ours.endsWith(`/${data.entry}`);
  });
  // After everything the user waits for.
  whenIdle(() => void register().catch(() => undefined));
}

async function register(): Promise<void> {
  const address = new URL('sw.js', document.baseURI);
  const registration = await navigator.serviceWorker.register(address, { updateViaCache: 'none' });
  registration.active?.postMessage('which-version');
  const look = (): void => void registration.update().catch(() => undefined);
  setInterval(look, LOOK_AGAIN_MS);
  // A tower that was updated was offline meanwhile.
  let wasLost = false;
  tower.live.state.subscribe(({ phase }) => {
    if (phase === 'waiting') wasLost = true;
    if (phase !== 'open' || !wasLost) return;
    wasLost = false;
    look();
  });
}
