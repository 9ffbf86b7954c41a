import { expect, it } from 'vitest';

import { flownThen, freeToJoin } from '../../src/words/team_words';
import { A_DRONE } from '../link/fakes';

const PETE = { id: 6, name: 'pete' };
const KESTREL = { ...A_DRONE, id: 1, name: 'Kestrel', owners: [PETE], holder: PETE };
const MERLIN = { ...A_DRONE, id: 2, name: 'Merlin', owners: [PETE], team: { id: 9, name: 'rescue' } };

it('names the drones that are flown, and what becomes of them', () => {
  const words = 'pete has the controls of Kestrel now: Kestrel is ordered to hold.';
  expect(flownThen([KESTREL, MERLIN], null)).toBe(words);
  expect(flownThen([KESTREL, MERLIN], [6])).toBe(words);
  expect(flownThen([KESTREL, MERLIN], [5])).toBe('');
});

it("offers a user's own drones that are in no team, and an admin of the tower all of these", () => {
  expect(freeToJoin([KESTREL, MERLIN], PETE, false)).toEqual([KESTREL]);
  expect(freeToJoin([KESTREL, MERLIN], { id: 5, name: 'olga' }, false)).toEqual([]);
  expect(freeToJoin([KESTREL, MERLIN], { id: 1, name: 'boss' }, true)).toEqual([KESTREL]);
});
