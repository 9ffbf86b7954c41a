import { expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { FRAME } from '../../src/plan/frames';
import { EMPTY_PLAN, spotOf, type Plan } from '../../src/plan/plan_types';
import { planItems, wireItem } from '../../src/plan/wire_items';
import { zoneFindings } from '../../src/plan/zone_findings';

const way = wireItem(CMD.WAYPOINT, FRAME.GLOBAL_RELATIVE_ALT, [0, 0, 0, null], 474000000, 85000000, 30);
const jump = wireItem(CMD.JUMP, 2, [1, 2, 0, 0], 0, 0, 0);
const plan: Plan = {
  ...EMPTY_PLAN,
  items: planItems([way, way, jump], 1),
  rally: [{ id: 9, frame: FRAME.GLOBAL_RELATIVE_ALT, spot: spotOf(47.4, 8.5), heightM: 30 }],
};

it('a zone that refuses is an error at its item, one that warns is a warning', () => {
  const words = 'leads into the no-fly zone Hospital (helicopter)';
  expect(zoneFindings(plan, 'mission', [{ item: 1, refuses: true, words }])).toEqual([
    { severity: 'error', kind: 'mission', part: plan.items[1]!.id, words: `The way to item 2 (Waypoint) ${words}.` },
  ]);
  const [warning] = zoneFindings(plan, 'mission', [{ item: 2, refuses: false, words }]);
  expect(warning).toMatchObject({ severity: 'warning', part: plan.items[2]!.id });
  expect(warning!.words).toBe(`The jump of item 3 ${words}. This zone only warns.`);
});

it('a rally point in a zone is named, and an item that is gone has no place', () => {
  const words = 'leads out of the corridor Valley';
  expect(zoneFindings(plan, 'rally', [{ item: 0, refuses: true, words }])).toEqual([
    { severity: 'error', kind: 'rally', part: 9, words: `Flying to rally point 1 ${words}.` },
  ]);
  expect(zoneFindings(plan, 'mission', [{ item: 7, refuses: true, words }])[0]).toMatchObject({ part: null });
});
