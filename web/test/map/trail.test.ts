import { describe, expect, it } from 'vitest';

import { Projection } from '../../src/map/projection';
import { pointsOf, thinned, wayAhead, wayBehind } from '../../src/map/trail';

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

  it('of a recorded flight is parted where the drone is', () => {
    const track = [0, 1, 2, 3].map((at) => ({ latDeg: 47 + at / 100, lonDeg: 8, upM: at }));
    const place = { latDeg: 47.015, lonDeg: 8, upM: 1.5 };
    expect([...wayBehind(track, 2, place)]).toEqual([track[0], track[1], place]);
    expect([...wayAhead(track, 2, place)]).toEqual([place, track[2], track[3]]);
    expect([...wayBehind(track, 0, place), ...wayAhead(track, 4, place)]).toEqual([place, place]);
    const flat = new Projection({ centre: track[0]!, zoom: 16, widthPx: 800, heightPx: 600 });
    expect([...pointsOf(flat, wayBehind(track, 1, place))]).toEqual([flat.at(track[0]!), flat.at(place)]);
  });
});
