import { describe, expect, it } from 'vitest';

import { clockwise, trackPoint } from '../../src/map/curtain';
import { Projection } from '../../src/map/projection';

const CENTRE = { latDeg: 47.4, lonDeg: 8.5 };
const ground = { homeM: 490, centreM: 530, heightM: () => 530 };
const shaped = new Projection({ centre: CENTRE, zoom: 16, widthPx: 800, heightPx: 600, tiltDeg: 55, ground });

describe('the curtain under a track', () => {
  it('hangs from the height above home, and from the ground where none is known', () => {
    expect(trackPoint(shaped, { ...CENTRE, upM: 70 })).toEqual(shaped.at(CENTRE, 70));
    // At the height of home, which is below this hill.
    expect(trackPoint(shaped, { ...CENTRE, upM: 0 }).y).toBeGreaterThan(shaped.at(CENTRE).y);
    expect(trackPoint(shaped, CENTRE)).toEqual(shaped.at(CENTRE));
  });

  it('turns all its areas one way, so that two that overlap leave no hole', () => {
    const corners = [
      { x: 0, y: 0 },
      { x: 4, y: 0 },
      { x: 4, y: 3 },
      { x: 0, y: 3 },
    ];
    expect(clockwise(corners)).toEqual(corners);
    expect(clockwise(corners.toReversed())).toEqual(corners);
  });
});
