import { describe, expect, it } from 'vitest';

import { gridLines, gridStep } from '../../src/map/graticule';

describe('the grid', () => {
  it.each([
    [50, 45, 0],
    [3, 2, 0],
    [0.9, 0.5, 1],
    [0.2, 0.2, 1],
    [0.0013, 0.001, 3],
    [0.00007, 0.00005, 5],
  ])('for %f degrees has a round step of %f', (wanted, stepDeg, decimals) => {
    const step = gridStep(wanted);
    expect(step.stepDeg).toBeCloseTo(stepDeg, 9);
    expect(step.decimals).toBe(decimals);
  });

  it('has lines on multiples of the step, inside the bounds', () => {
    expect(gridLines(-0.25, 0.35, { stepDeg: 0.2, decimals: 1 }).map((one) => one.toFixed(1))).toEqual([
      '-0.2',
      '0.0',
      '0.2',
    ]);
    expect(gridLines(5.1, 5.2, { stepDeg: 1, decimals: 0 })).toEqual([]);
  });

  it('never has too many of them', () => {
    expect(gridLines(-1e6, 1e6, { stepDeg: 0.001, decimals: 3 }).length).toBeLessThan(100);
  });
});
