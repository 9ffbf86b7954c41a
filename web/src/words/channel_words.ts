/** Words about alert channels. */

import type { AlertChannel } from '../link/admin_types';

export const SEVERITY_CHOICES: Readonly<Record<AlertChannel['severity'], string>> = {
  critical: 'critical only',
  warning: 'warnings and critical',
  notice: 'all',
};

/** A mail address, a browser, or the host of a webhook: the rest of its address may be a secret. */
export function channelName({ kind, target, browser }: Pick<AlertChannel, 'kind' | 'target' | 'browser'>): string {
  if (kind === 'mail') return target;
  const host = URL.canParse(target) ? new URL(target).host : target;
  return kind === 'push' ? browser || `a browser (${host})` : `the webhook at ${host}`;
}

/** What is wrong with it, or that it works, if that is known. */
export function channelState(channel: AlertChannel): string {
  if (!channel.is_confirmed) return 'waits for its code';
  const waiting = channel.waiting > 0 ? `${channel.waiting} on the way` : '';
  const problem = channel.problem && `last attempt: ${channel.problem}`;
  return [problem, waiting].filter(Boolean).join('; ') || (channel.sent_at ? 'works' : 'not used yet');
}
