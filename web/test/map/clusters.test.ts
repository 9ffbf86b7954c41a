import { expect, it } from 'vitest';

import { gather } from '../../src/map/clusters';

const at = (id: number, x: number, y: number) => ({ id, at: { x, y } });

it('gathers what is near, in the middle of its members, and leaves alone what is not', () => {
  const clusters = gather([at(1, 0, 0), at(2, 10, 0), at(3, 500, 0), at(4, 0, 20)], 36);
  expect(clusters.map(({ members }) => members.map(({ id }) => id))).toEqual([[1, 2, 4], [3]]);
  expect(clusters[0]).toMatchObject({ x: 10 / 3, y: 20 / 3 });
});

it('does not chain a whole row into one', () => {
  const row = Array.from({ length: 10 }, (_, id) => at(id, id * 20, 0));
  expect(gather(row, 36).length).toBeGreaterThan(3);
});

it('of nothing is nothing', () => {
  expect(gather([], 36)).toEqual([]);
});
