/** The quality of a link in words. */

import type { LinkGrade, LinkReading } from '../link/link_quality';
import { fixed, UNKNOWN } from './format';

export const GRADE_WORDS: Record<LinkGrade, string> = { good: 'Good', fair: 'Fair', poor: 'Poor', bad: 'Bad' };
export const GRADE_BARS: Record<LinkGrade, number> = { good: 4, fair: 3, poor: 2, bad: 1 };

export function transportWords(transport: string | null): string {
  if (transport === null) return UNKNOWN;
  return transport === 'udp' ? 'UDP' : transport === 'websocket' ? 'WebSocket: UDP is blocked' : transport;
}

/** One line for a tooltip or a screen reader. */
export function linkWords(link: LinkReading | null): string {
  if (!link) return 'Link not known';
  const { rttMs, lossUpPercent, lossDownPercent } = link.over1s;
  const loss = `${fixed(lossUpPercent)} % lost up, ${fixed(lossDownPercent)} % down`;
  return `Link ${GRADE_WORDS[link.grade].toLowerCase()}: round trip ${fixed(rttMs)} ms, ${loss}`;
}
