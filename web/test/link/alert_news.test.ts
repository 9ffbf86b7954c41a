import { expect, it } from 'vitest';

import { AlertNews } from '../../src/link/alert_news';
import type { Alert } from '../../src/link/alerts';
import { anAlert } from './fakes';

const low = anAlert({ id: 1 });
const lost = anAlert({ id: 2, rule: 'link-lost', severity: 'critical', rank: 0 });
const notice = anAlert({ id: 3, severity: 'notice' });
const told = (news: AlertNews, ...all: Alert[]): number[] => news.look(all).map(({ id }) => id);

it('tells each alert once, the worst first', () => {
  const news = new AlertNews();
  expect(told(news)).toEqual([]);
  expect(told(news, low)).toEqual([1]);
  expect(told(news, low, lost, anAlert({ id: 4, rank: 1 }))).toEqual([2, 4]);
  expect(told(news, low, lost)).toEqual([]);
});

it('tells only the worst of those that a page finds when it opens', () => {
  expect(told(new AlertNews(), low, lost)).toEqual([2]);
});

it('says nothing about a notice, what is over, and what somebody has seen to', () => {
  const news = new AlertNews();
  const over = '2026-01-01T12:05:00Z';
  expect(told(news, notice, anAlert({ id: 5, closed_at: over }), anAlert({ id: 6, acknowledged_at: over }))).toEqual(
    [],
  );
  expect(told(news, { ...notice, severity: 'warning' }), 'it became worse').toEqual([3]);
});
