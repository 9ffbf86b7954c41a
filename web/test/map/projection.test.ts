import { describe, expect, it } from 'vitest';

import { Projection } from '../../src/map/projection';

const CENTRE = { latDeg: 47.4, lonDeg: 8.5 };
const camera = { centre: CENTRE, zoom: 16, widthPx: 800, heightPx: 600 };
const METRES_PER_PX = (40_075_016.7 * Math.cos((47.4 * Math.PI) / 180)) / (512 * 2 ** 16);

describe('the projection', () => {
  it('has the centre in the middle, north up and east to the right', () => {
    const projection = new Projection(camera);
    expect(projection.at(CENTRE)).toEqual({ x: 400, y: 300 });
    expect(projection.at({ latDeg: 47.401, lonDeg: 8.5 }).y).toBeLessThan(300);
    expect(projection.at({ latDeg: 47.4, lonDeg: 8.501 }).x).toBeGreaterThan(400);
  });

  it('has the scale of Web Mercator', () => {
    const north = new Projection(camera).at({ latDeg: 47.4 + 0.001, lonDeg: 8.5 });
    const metres = (300 - north.y) * METRES_PER_PX;
    expect(metres).toBeGreaterThan(110);
    expect(metres).toBeLessThan(112);
  });

  it('takes the near copy of a place across the antimeridian', () => {
    const fiji = new Projection({ ...camera, centre: { latDeg: -17, lonDeg: 179.99 } });
    const across = fiji.at({ latDeg: -17, lonDeg: -179.99 });
    expect(across.x).toBeGreaterThan(400);
    expect(across.x).toBeLessThan(400 + 2_000);
  });
});
