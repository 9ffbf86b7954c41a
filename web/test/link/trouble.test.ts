import { expect, it } from 'vitest';

import { isToldOtherwise, troubleOf } from '../../src/link/trouble';
import { anAlert } from './fakes';

it('is the most urgent alert of a drone', () => {
  const lost = anAlert({ id: 2, rule: 'link-lost', severity: 'critical', badge: 'Lost in the air', rank: 0 });
  expect(troubleOf([lost, anAlert()])).toEqual({
    kind: 'link-lost',
    severity: 'critical',
    badge: 'Lost in the air',
    rank: 0,
    alert: lost,
  });
});

it('is no notice', () => {
  expect(troubleOf([])).toBeNull();
  expect(troubleOf([anAlert({ severity: 'notice' })])).toBeNull();
  expect(troubleOf([anAlert({ severity: 'notice' }), anAlert({ rank: 20 })])?.rank).toBe(20);
});

it('leaves to the row what it tells anyway', () => {
  const kinds = ['unattended', 'lost-action', 'link-lost'].map((rule) => troubleOf([anAlert({ rule })])!);
  expect(kinds.map(isToldOtherwise)).toEqual([true, true, false]);
});
