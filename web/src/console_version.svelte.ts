/**
 * Has the service worker keep the console for times without a network, and hears from it when the tower has a newer
 * version. Nothing here ever reloads the page: that takes the word of whoever may be flying from it.
 */

import { tower } from './tower.svelte';
import { whenIdle } from './when_idle';

const LOOK_AGAIN_MS = 3_600_000;

/** `isOutdated`: the tower serves another version than this page is of. */
export const consoleVersion = $state({ isOutdated: false });

/** The script that this page was started with: its name has a hash of what is in it. */
const ours = document.querySelector<HTMLScriptElement>('script[type="module"][src]')?.src ?? '';

interface News {
  readonly type: 'console-version';
  readonly entry: string;
}

const isNews = (data: unknown): data is News =>
  typeof data === 'object' && data !== null && (data as Partial<News>).type === 'console-version';

export function keepConsole(): void {
  // While developing there is none. Without https the browser allows it on localhost only.
  if (!import.meta.env.PROD || !('serviceWorker' in navigator)) return;
  navigator.serviceWorker.addEventListener('message', ({ data }) => {
    if (isNews(data)) consoleVersion.isOutdated = !ours.endsWith(`/${data.entry}`);
  });
  // After all that somebody waits for.
  whenIdle(() => void register().catch(() => undefined));
}

async function register(): Promise<void> {
  const address = new URL('sw.js', document.baseURI);
  const registration = await navigator.serviceWorker.register(address, { updateViaCache: 'none' });
  registration.active?.postMessage('which-version');
  const look = (): void => void registration.update().catch(() => undefined);
  setInterval(look, LOOK_AGAIN_MS);
  // A tower that was renewed was away meanwhile.
  let wasLost = false;
  tower.live.state.subscribe(({ phase }) => {
    if (phase === 'waiting') wasLost = true;
    if (phase !== 'open' || !wasLost) return;
    wasLost = false;
    look();
  });
}
