import { describe, expect, it } from 'vitest';

import { Obstacles, type Box } from '../../src/map/obstacles';

const box = (left: number, top: number, width = 40, height = 16): Box => ({
  left,
  top,
  right: left + width,
  bottom: top + height,
});

describe('what is in the way', () => {
  it('is found wherever it stands, over the edges of the grid and off the screen too', () => {
    for (const [x, y] of [
      [0, 0],
      [50, 60],
      [-30, -10],
      [640, 1279],
    ] as const) {
      const obstacles = new Obstacles();
      obstacles.add(box(x, y));
      expect(obstacles.isFree(box(x + 39, y + 15))).toBe(false);
      expect(obstacles.isFree(box(x + 40, y))).toBe(true);
      expect(obstacles.isFree(box(x - 40, y))).toBe(true);
      expect(obstacles.isFree(box(x, y + 16))).toBe(true);
    }
  });

  it('is not what belongs to who asks', () => {
    const obstacles = new Obstacles();
    obstacles.add(box(0, 0), 7);
    expect(obstacles.isFree(box(0, 0), 7)).toBe(true);
    expect(obstacles.isFree(box(0, 0), 8)).toBe(false);
  });

  it('finds what comparing each with each finds', () => {
    const boxes = Array.from({ length: 200 }, (_, n) => box((n * 197) % 900, (n * 89) % 700, 20 + (n % 70), 16));
    const asked = Array.from({ length: 300 }, (_, n) => box((n * 131) % 950, (n * 57) % 750));
    const obstacles = new Obstacles();
    for (const one of boxes) obstacles.add(one);
    const plainly = (a: Box): boolean =>
      !boxes.some((b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom);
    expect(asked.map((one) => obstacles.isFree(one))).toEqual(asked.map(plainly));
  });
});
