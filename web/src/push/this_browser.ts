/** Web push in this browser: whether it can, its subscription, and its end. Knows no tower. */

import { t } from '../languages/text';

const READY_WITHIN_MS = 15_000;

/** The parts of `window` that matter. */
interface Page {
  readonly isSecureContext: boolean;
  readonly navigator: Navigator;
  readonly PushManager?: unknown;
  readonly Notification?: unknown;
}

/** Why this browser cannot show alerts while the console is closed, and what to do; empty: it can. */
export function whyNoPush(page: Page = window): string {
  if (!page.isSecureContext)
    return t('Browsers show notifications only of a console that is opened with https, or on the tower’s own machine.');
  if (!('serviceWorker' in page.navigator) || !('PushManager' in page) || !('Notification' in page))
    return t(
      'This browser cannot show alerts while the console is closed. On an iPhone or iPad, add the console to the home screen first and open it from there. In a private window it is never possible.',
    );
  return '';
}

export async function subscriptionHere(): Promise<PushSubscription | null> {
  if (whyNoPush()) return null;
  const registration = await navigator.serviceWorker.getRegistration(document.baseURI);
  return (await registration?.pushManager.getSubscription()) ?? null;
}

/** Asks the user for permission: call it at a click. `publicKey`: of the tower. */
export async function subscribe(publicKey: string): Promise<PushSubscription> {
  const permission = await Notification.requestPermission();
  if (permission === 'denied')
    throw new Error(t('This browser blocks notifications of the console. Allow them in its settings for this page.'));
  if (permission !== 'granted') throw new Error(t('The browser was not allowed to show notifications.'));
  const { pushManager } = await readyWorker();
  const options = { userVisibleOnly: true, applicationServerKey: bytesOf(publicKey) };
  try {
    return await pushManager.subscribe(options);
  } catch (error) {
    // It has a subscription with a key that the tower had before.
    const old = await pushManager.getSubscription();
    if (!old || !(error instanceof DOMException) || error.name !== 'InvalidStateError') throw error;
    await old.unsubscribe();
    return pushManager.subscribe(options);
  }
}

/** As the tower wants them. */
export function keysOf(subscription: PushSubscription): { endpoint: string; p256dh: string; auth: string } {
  const { endpoint, keys } = subscription.toJSON();
  const { p256dh, auth } = keys ?? {};
  if (!endpoint || !p256dh || !auth) throw new Error(t('The browser gave a subscription without keys.'));
  return { endpoint, p256dh, auth };
}

async function readyWorker(): Promise<ServiceWorkerRegistration> {
  const late = new Promise<never>((_, reject) =>
    setTimeout(
      () => reject(new Error(t('The console is not kept in this browser yet. Reload the page and try again.'))),
      READY_WITHIN_MS,
    ),
  );
  return Promise.race([navigator.serviceWorker.ready, late]);
}

/** Of base64url without padding. */
export function bytesOf(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (letter) => letter.charCodeAt(0));
}
