/** Shows alerts that the tower pushes while no console is open, and opens the console on a click. */

import { noteOf, optionsOf, pageToFocus } from './alert_note';

const ICON = 'icon-192.png';

interface WithPath {
  readonly path?: string;
}

export function listenToPush(worker: ServiceWorkerGlobalScope): void {
  const { scope } = worker.registration;

  async function show(text: string): Promise<void> {
    const note = noteOf(text);
    await worker.registration.showNotification(note.title, optionsOf(note, new URL(ICON, scope).href));
  }

  async function open(path: string): Promise<void> {
    const pages = await worker.clients.matchAll({ type: 'window', includeUncontrolled: true });
    const page = pageToFocus(pages, scope);
    if (page) await page.focus();
    else await worker.clients.openWindow(new URL(path, scope).href);
  }

  worker.addEventListener('push', (event) => {
    event.waitUntil(show(event.data?.text() ?? ''));
  });

  worker.addEventListener('notificationclick', (event) => {
    event.notification.close();
    event.waitUntil(open((event.notification.data as WithPath | null)?.path ?? '#/'));
  });
}
