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

  it('looks from the side: the middle stays, the far half shrinks, height rises', () => {
    const tilted = new Projection({ ...camera, tiltDeg: 55 });
    expect(tilted.at(CENTRE)).toEqual({ x: 400, y: 300 });
    const flat = new Projection(camera);
    const [far, near] = [
      { latDeg: 47.401, lonDeg: 8.501 },
      { latDeg: 47.399, lonDeg: 8.501 },
    ];
    expect(tilted.at(far).x - 400).toBeLessThan(flat.at(far).x - 400);
    expect(tilted.at(near).x - 400).toBeGreaterThan(flat.at(near).x - 400);
    // By hand: 100 m at the middle are `up` pixels, seen under 55 degrees by an eye 900 px away.
    const up = 100 / METRES_PER_PX;
    const [sin, cos] = [Math.sin((55 * Math.PI) / 180), Math.cos((55 * Math.PI) / 180)];
    expect(tilted.at(CENTRE, 100).y).toBeCloseTo(300 - (up * sin * 900) / (900 - up * cos), 3);
    expect(flat.at(CENTRE, 100)).toEqual({ x: 400, y: 300 });
  });

  it('follows the ground that the map draws: places on it, and heights above home', () => {
    // The middle of the map is on a hill of 530 m, home in the plain at 490 m.
    const ground = {
      homeM: 490,
      centreM: 530,
      heightM: ({ latDeg }: { latDeg: number }) => (latDeg > 47.4005 ? 490 : 530),
    };
    const shaped = new Projection({ ...camera, tiltDeg: 55, ground });
    const [sin, cos] = [Math.sin((55 * Math.PI) / 180), Math.cos((55 * Math.PI) / 180)];
    // By hand, as above: `upM` above the middle.
    const y = (upM: number): number => {
      const up = upM / METRES_PER_PX;
      return 300 - (up * sin * 900) / (900 - up * cos);
    };
    expect(shaped.at(CENTRE).y).toBeCloseTo(300, 6);
    expect(shaped.at(CENTRE, 100).y).toBeCloseTo(y(490 + 100 - 530), 3);
    expect(shaped.aboveHome(CENTRE, 0).y).toBeCloseTo(y(490 - 530), 3);
    const plain = { latDeg: 47.401, lonDeg: 8.501 };
    expect(shaped.at(plain)).toEqual(shaped.aboveHome(plain, 0));
    // Lower ground is farther from the eye: nearer to the middle across, and lower on the screen.
    const flat = new Projection({ ...camera, tiltDeg: 55 }).at(plain);
    expect(shaped.at(plain).x).toBeLessThan(flat.x);
    expect(shaped.at(plain).y).toBeGreaterThan(flat.y);
    // From above nothing of it counts.
    expect(new Projection({ ...camera, ground }).at(plain, 100)).toEqual(new Projection(camera).at(plain));
  });

  it('keeps what is behind the eye off the screen', () => {
    const tilted = new Projection({ ...camera, tiltDeg: 55 });
    expect(tilted.at({ latDeg: 47.3, lonDeg: 8.5 }).y).toBeGreaterThan(600);
  });
});
