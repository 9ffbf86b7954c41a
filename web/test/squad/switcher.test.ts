import { describe, expect, it } from 'vitest';

import { inSwitcherOrder, MAX_SWITCHER_ENTRIES } from '../../src/squad/switcher';

const one = (id: number, name: string, isOwn = false, rank: number | null = null) => ({ id, name, isOwn, rank });

describe('the switcher', () => {
  it("lists one's own drones, then those in trouble, the worst first, then the others by name", () => {
    const entries = [
      one(1, 'Osprey 10'),
      one(2, 'Osprey 9'),
      one(3, 'Swift', false, 20),
      one(4, 'Kestrel', false, 5),
      one(5, 'Wren', true),
      one(6, 'Merlin', true, 30),
    ];
    expect(inSwitcherOrder(entries).map(({ name }) => name)).toEqual([
      'Merlin',
      'Wren',
      'Kestrel',
      'Swift',
      'Osprey 9',
      'Osprey 10',
    ]);
  });

  it('keeps to what one can look through', () => {
    const many = Array.from({ length: 500 }, (_, id) => one(id, `Drone ${id}`, id === 499));
    const listed = inSwitcherOrder(many);
    expect(listed).toHaveLength(MAX_SWITCHER_ENTRIES);
    expect(listed[0]!.id).toBe(499);
  });
});
