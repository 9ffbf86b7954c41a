/** Words about alert channels. */

import { t } from '../languages/text';
import { towerText } from '../languages/tower_text';
import type { AlertChannel } from '../link/admin_types';

export const SEVERITY_CHOICES: Readonly<Record<AlertChannel['severity'], string>> = {
  critical: t('critical only'),
  warning: t('warnings and critical'),
  notice: t('all'),
};

/** A mail address, a browser, or the host of a webhook: the rest of its address may be a secret. */
export function channelName({ kind, target, browser }: Pick<AlertChannel, 'kind' | 'target' | 'browser'>): string {
  if (kind === 'mail') return target;
  const host = URL.canParse(target) ? new URL(target).host : target;
  return kind === 'push' ? browser || t('a browser ({host})', { host }) : t('the webhook at {host}', { host });
}

/** What is wrong with it, or that it works, if that is known. */
export function channelState(channel: AlertChannel): string {
  if (!channel.is_confirmed) return t('waits for its code');
  const waiting = channel.waiting > 0 ? t('{waiting} on the way', { waiting: channel.waiting }) : '';
  const problem = channel.problem && t('last attempt: {problem}', { problem: towerText(channel.problem) });
  return [problem, waiting].filter(Boolean).join('; ') || (channel.sent_at ? t('works') : t('not used yet'));
}
