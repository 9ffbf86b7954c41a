import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { FOLLOW_SIDES, placeBeside, placeFault, placeWords, type FollowSide } from '../../src/squad/follow_place';

type Beside = Exclude<FollowSide, 'metres'>;
const SIDES = FOLLOW_SIDES.map(({ value }) => value).filter((one): one is Beside => one !== 'metres');

describe('the place of a follower', () => {
  it.each<[Beside, number, [number, number, number]]>([
    ['behind', 0, [-20, 0, 3]],
    ['behind', 90, [0, -20, 3]],
    ['ahead', 180, [-20, 0, 3]],
    ['left', 0, [0, -20, 3]],
    ['right', 0, [0, 20, 3]],
    ['right', 90, [-20, 0, 3]],
    ['behind-left', 0, [-14.1, -14.1, 3]],
    ['behind-right', 0, [-14.1, 14.1, 3]],
    ['above', 77, [0, 0, 3]],
  ])('%s of one that goes to %i degrees', (side, heading, [northM, eastM, upM]) => {
    const place = placeBeside(side, heading, 20, 3);
    expect(place.northM).toBeCloseTo(northM, 1);
    expect(place.eastM).toBeCloseTo(eastM, 1);
    expect(place.upM).toBe(upM);
  });

  it('is as far away as was asked for, whatever the heading, and never refused for what rounding took from it', () => {
    fc.assert(
      fc.property(
        fc.constantFrom(...SIDES),
        fc.double({ min: -360, max: 360, noNaN: true }),
        fc.integer({ min: 8, max: 100 }),
        (side, heading, away) => {
          const place = placeBeside(side, heading, away, side === 'above' ? away : 0);
          expect(Math.hypot(place.northM, place.eastM, place.upM)).toBeCloseTo(away, 0);
          expect(placeFault(place, 'metric')).toBe('');
        },
      ),
    );
  });

  it('is refused with words where it is too near, too far, or no number', () => {
    expect(placeFault({ northM: 5, eastM: 5, upM: 7 }, 'metric')).toContain('Too near: 8 m');
    expect(placeFault({ northM: 5, eastM: 5, upM: -8 }, 'metric')).toBe('');
    expect(placeFault({ northM: 101, eastM: 0, upM: 0 }, 'metric')).toContain('100 m');
    expect(placeFault({ northM: NaN, eastM: 20, upM: 0 }, 'metric')).not.toBe('');
  });

  it.each<[[number, number, number], string]>([
    [[-14, 0, 3], '14 m south of Merlin and 3 m above it'],
    [[-10, -10, 0], '14 m south-west of Merlin'],
    [[0, 20, -2.5], '20 m east of Merlin and 2.5 m below it'],
    [[0, 0, 10], '10 m above Merlin'],
    [[30, -1, 0], '30 m north of Merlin'],
  ])('%j in words', ([northM, eastM, upM], words) => {
    expect(placeWords({ northM, eastM, upM }, 'Merlin', 'metric')).toBe(words);
  });
});
