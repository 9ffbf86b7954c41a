import { describe, expect, it } from 'vitest';

import { thinned } from '../../src/map/trail';

describe('a trail', () => {
  it('keeps its ends, and of what lies between only what can be told apart', () => {
    const points = Array.from({ length: 101 }, (_, x) => ({ x: x / 10, y: 0 }));
    expect(thinned(points, 3).map(({ x }) => x)).toEqual([0, 3, 6, 9, 10]);
  });

  it('keeps its corners to within a step', () => {
    const points = [
      ...Array.from({ length: 50 }, (_, x) => ({ x, y: 0 })),
      ...Array.from({ length: 50 }, (_, y) => ({ x: 50, y })),
    ];
    const kept = thinned(points, 3);
    for (const point of points)
      expect(Math.min(...kept.map(({ x, y }) => Math.max(Math.abs(x - point.x), Math.abs(y - point.y))))).toBeLessThan(
        3,
      );
  });

  it('of one point or none is itself', () => {
    expect(thinned([])).toEqual([]);
    expect(thinned([{ x: 1, y: 2 }])).toEqual([{ x: 1, y: 2 }]);
  });
});
