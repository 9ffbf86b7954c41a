import { describe, expect, it } from 'vitest';

import { besideTarget, type PanelPlace } from '../../src/map/beside_target';

const PANEL = { width: 270, height: 210 };
/** So much is kept free round the place: the radius of its symbol. */
const SYMBOL_PX = 14;

const covers = ({ left, top }: PanelPlace, { x, y }: { x: number; y: number }, px: number): boolean =>
  x > left - px && x < left + PANEL.width + px && y > top - px && y < top + PANEL.height + px;

describe('the panel of a pressed place', () => {
  it('never covers the place, and stays on the map, wherever it is pressed', () => {
    for (const map of [
      { width: 840, height: 800 },
      { width: 390, height: 360 },
      { width: 500, height: 300 },
    ])
      for (let x = 0; x <= map.width; x += 10)
        for (let y = 0; y <= map.height; y += 10) {
          const panel = besideTarget({ x, y }, PANEL, map);
          const at = { x, y: y + panel.moveDownPx };
          const where = JSON.stringify({ map, x, y, panel });
          expect(covers(panel, at, SYMBOL_PX), where).toBe(false);
          expect(at.y, where).toBeGreaterThanOrEqual(0);
          expect(panel.left >= 0 && panel.left + PANEL.width <= map.width, where).toBe(true);
          expect(panel.top >= 0 && panel.top + PANEL.height <= map.height, where).toBe(true);
        }
  });

  it('moves the map only where it has room on no side', () => {
    expect(besideTarget({ x: 600, y: 400 }, PANEL, { width: 840, height: 800 }).moveDownPx).toBe(0);
    expect(besideTarget({ x: 195, y: 180 }, PANEL, { width: 390, height: 360 }).moveDownPx).toBeLessThan(0);
  });

  it('leaves the drone free if another side has room', () => {
    const [at, map] = [
      { x: 300, y: 400 },
      { width: 840, height: 800 },
    ];
    expect(besideTarget(at, PANEL, map).left).toBeGreaterThan(at.x);
    const drone = { x: 420, y: 400 };
    expect(covers(besideTarget(at, PANEL, map, drone), drone, 0)).toBe(false);
  });
});
