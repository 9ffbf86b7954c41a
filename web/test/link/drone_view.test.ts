import { describe, expect, it } from 'vitest';

import {
  eitherSays,
  mayDeleteRecordings,
  mayHaveControls,
  mayStay,
  mayTake,
  mayTakeFree,
} from '../../src/link/drone_view';
import type { Drone, User } from '../../src/link/wire_types';
import { A_DRONE } from './fakes';

const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const PETE: User = { id: 6, name: 'pete', role: 'operator' };
const BOSS: User = { id: 1, name: 'boss', role: 'admin' };
const LOAN = { user: { id: 6, name: 'pete' }, until: '', may_arm: true, max_height_m: null, radius_m: null };

it.each([
  [true, null, true],
  [true, false, true],
  [false, true, true],
  [false, null, false],
  [null, false, false],
  [null, null, null],
] as const)('of %s and %s either says %s', (one, other, either) => {
  expect(eitherSays(one, other)).toBe(either);
});

describe('"stay" may be said by', () => {
  it.each<[string, Partial<Drone>, User, boolean]>([
    ['an admin', {}, BOSS, true],
    ['an owner', {}, OLGA, true],
    ['an owner while somebody else holds it', { holder: BOSS }, OLGA, true],
    ['no owner from whom it was taken', { holder: BOSS, taken_from: OLGA }, OLGA, false],
    ['an owner to whom it is offered back', { holder: BOSS, taken_from: OLGA, offered: true }, OLGA, true],
    ['the holder', { holder: PETE }, PETE, true],
    ['a borrower', { loans: [LOAN] }, PETE, true],
    ['no borrower from whom it was taken', { loans: [LOAN], taken_from: PETE }, PETE, false],
    ['nobody else', {}, PETE, false],
  ])('%s', (_, changes, user, may) => {
    expect(mayStay({ ...A_DRONE, ...changes }, user)).toBe(may);
  });
});

describe('what somebody may do follows how they stand to the drone', () => {
  it.each([
    ['admin', BOSS, true, true, true],
    ['team-admin', OLGA, true, true, true],
    ['team-operator', PETE, true, false, false],
    ['borrower', PETE, true, false, false],
    ['observer', PETE, false, false, false],
  ] as const)('%s', (relation, user, flies, takes, deletes) => {
    const drone = { ...A_DRONE, owners: [], relation };
    expect(mayHaveControls(drone, user)).toBe(flies);
    expect(mayTake(drone, user)).toBe(takes);
    expect(mayDeleteRecordings(drone, user)).toBe(deletes);
    expect(mayStay(drone, user)).toBe(flies);
  });

  it('and of an older tower its owners and borrowers are believed', () => {
    expect(mayHaveControls(A_DRONE, OLGA)).toBe(true);
    expect(mayHaveControls({ ...A_DRONE, loans: [LOAN] }, PETE)).toBe(true);
    expect(mayHaveControls(A_DRONE, PETE)).toBe(false);
    expect(mayTake(A_DRONE, OLGA)).toBe(false);
  });
});

describe('the controls may be taken up by', () => {
  it.each<[string, Partial<Drone>, User, boolean]>([
    ['an owner of a free drone', {}, OLGA, true],
    ['nobody while somebody has them', { holder: PETE }, OLGA, false],
    ['nobody who has them', { holder: OLGA }, OLGA, false],
    ['no owner from whom they were taken', { taken_from: OLGA }, OLGA, false],
    ['another owner then', { taken_from: PETE }, OLGA, true],
    ['an admin', {}, BOSS, true],
    ['no observer', { owners: [], relation: 'observer' }, PETE, false],
  ])('%s', (_, drone, user, may) => {
    expect(mayTakeFree({ ...A_DRONE, ...drone }, user)).toBe(may);
  });
});
