import { beforeEach, describe, expect, it } from 'vitest';

import type { Place } from '../../src/link/messages';
import { AutoFit, GATHERING_MS, type Located } from '../../src/map/auto_fit';

const at = (id: number, latDeg = 47, lonDeg = 8): Located => ({ id, place: { latDeg, lonDeg } });

let fitted: (readonly Place[])[];
let canFit: boolean;
let auto: AutoFit;
const consider = (drones: readonly Located[], nowMs: number): void =>
  auto.consider(drones, nowMs, (places) => {
    fitted.push(places);
    return canFit;
  });

beforeEach(() => {
  fitted = [];
  canFit = true;
  auto = new AutoFit();
});

describe('the map goes to the squad', () => {
  it('with the first position, however late that comes', () => {
    consider([], 0);
    consider([], 10 * GATHERING_MS);
    expect(fitted).toEqual([]);
    consider([at(1)], 10 * GATHERING_MS + 1);
    expect(fitted).toEqual([[at(1).place]]);
  });

  it('anew for each drone that gets its position a little later, and not for one that moves', () => {
    consider([at(1)], 1_000);
    consider([at(1, 47.002)], 2_000);
    consider([at(1, 47.002), at(2)], 3_000);
    consider([at(1, 47.004), at(2)], 4_000);
    expect(fitted.map((places) => places.length)).toEqual([1, 2]);
  });

  it('anew when a first position was nowhere near', () => {
    consider([at(1, 0, 0.01), at(2)], 1_000);
    consider([at(1, 0, 0.01), at(2)], 1_200);
    expect(fitted).toHaveLength(1);
    consider([at(1), at(2)], 1_400);
    expect(fitted).toHaveLength(2);
    consider([at(1, 47.5), at(2)], 1_600 + 160_000); // 55 km in 160 s: it flew there
    expect(fitted).toHaveLength(2);
  });

  it('again until the map could do it', () => {
    canFit = false;
    consider([at(1)], 0);
    consider([at(1)], 200);
    canFit = true;
    consider([at(1)], 400);
    consider([at(1)], 600);
    expect(fitted).toHaveLength(3);
  });

  it('no more for drones that come long after the others', () => {
    consider([at(1)], 0);
    consider([at(1), at(2)], GATHERING_MS + 1);
    expect(fitted).toHaveLength(1);
  });

  it('no more once the user has moved it, even before the first position', () => {
    auto.moved();
    consider([at(1)], 0);
    expect(fitted).toEqual([]);
  });
});
