/** The quality of a link in words. */

import { t } from '../languages/text';
import type { LinkGrade, LinkReading } from '../link/link_quality';
import { fixed, UNKNOWN } from './format';

export const GRADE_WORDS: Record<LinkGrade, string> = {
  good: t('Good'),
  fair: t('Fair'),
  poor: t('Poor'),
  bad: t('Bad'),
};
export const GRADE_BARS: Record<LinkGrade, number> = { good: 4, fair: 3, poor: 2, bad: 1 };

export function transportWords(transport: string | null): string {
  if (transport === null) return UNKNOWN;
  return transport === 'udp' ? 'UDP' : transport === 'websocket' ? t('WebSocket: UDP is blocked') : transport;
}

/** One line for a tooltip or a screen reader. */
export function linkWords(link: LinkReading | null): string {
  if (!link) return t('Link not known');
  const { rttMs, lossUpPercent, lossDownPercent } = link.over1s;
  const loss = t('{lossUp} % lost up, {lossDown} % down', {
    lossUp: fixed(lossUpPercent),
    lossDown: fixed(lossDownPercent),
  });
  return t('Link {grade}: round trip {rtt} ms, {loss}', {
    grade: GRADE_WORDS[link.grade].toLowerCase(),
    rtt: fixed(rttMs),
    loss,
  });
}
