/**
 * At the start of the console: tells the tower that the browser is here with this session, whose sign-out is to end its
 * alerts. A subscription of somebody else, or one that was deleted elsewhere, ends here: nobody reads another's alerts.
 */

import { rest } from '../admin';
import { subscriptionHere } from './this_browser';

export async function keepThisBrowser(): Promise<void> {
  const subscription = await subscriptionHere();
  if (!subscription) return;
  const channels = await rest.call('GET', '/me/alert-channels');
  const mine = channels.find(({ kind, target }) => kind === 'push' && target === subscription.endpoint);
  if (mine) await rest.call('POST', '/me/alert-channels/browsers/{channel_id}/keep', { path: { channel_id: mine.id } });
  else await subscription.unsubscribe();
}
