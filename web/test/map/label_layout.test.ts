import { describe, expect, it } from 'vitest';

import { layoutLabels, type LabelPlace, type LabelWanted } from '../../src/map/label_layout';

const RADIUS = 20;
const wanted = (id: number, x: number, y: number, width = 60): LabelWanted => ({ id, x, y, width, height: 16 });
const lay = (labels: readonly LabelWanted[], last = new Map<number, number>()): Map<number, LabelPlace> =>
  layoutLabels(labels, RADIUS, last);

function covers(a: LabelPlace, b: LabelPlace, width: number): boolean {
  return Math.abs(a.x - b.x) < width && Math.abs(a.y - b.y) < 16;
}

describe('names on the map', () => {
  it('stand to the right of the marker where there is room', () => {
    const at = lay([wanted(1, 100, 100)]).get(1)!;
    expect([at.x, at.y, at.isFar]).toEqual([100 + RADIUS, 100, false]);
  });

  it('of drones in one place do not cover each other', () => {
    const places = [...lay([1, 2, 3, 4, 5].map((id) => wanted(id, 100, 100))).values()];
    expect(places).toHaveLength(5);
    for (const [index, a] of places.entries())
      for (const b of places.slice(index + 1)) expect(covers(a, b, 60)).toBe(false);
  });

  it('do not cover the marker of a neighbour', () => {
    const at = lay([wanted(1, 100, 100), wanted(2, 140, 100)]).get(1)!;
    expect(at.x).toBeLessThan(100);
  });

  it('stand clear of a ring around their own marker', () => {
    const at = lay([{ ...wanted(1, 100, 100), radiusPx: 28 }]).get(1)!;
    expect(at.x).toBe(128);
  });

  it('do not cover what else stands on the map', () => {
    const target = { left: 110, right: 230, top: 80, bottom: 120 };
    const at = layoutLabels([wanted(1, 100, 100)], RADIUS, new Map(), [target]).get(1)!;
    expect(at.x + 60).toBeLessThanOrEqual(target.left);
  });

  it('are left out where there is no room, the last ones first', () => {
    const crowd = Array.from({ length: 60 }, (_, id) => wanted(id, 100, 100));
    const places = lay(crowd);
    expect(places.has(0)).toBe(true);
    expect(places.size).toBeLessThan(60);
  });

  it('keep their place from one drawing to the next', () => {
    const first = lay([wanted(1, 100, 100), wanted(2, 140, 100)]);
    const slots = new Map([...first].map(([id, { slot }]) => [id, slot]));
    expect(lay([wanted(1, 100, 100)], slots).get(1)!.slot).toBe(first.get(1)!.slot);
  });
});
