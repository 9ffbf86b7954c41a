import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { offsetBy } from '../../src/link/geometry';
import { arePlacesApart, placeFault } from '../../src/squad/follow_place';
import {
  formationOf,
  formationPlaces,
  USUAL_FORMATION,
  type Flier,
  type FormationSettings,
} from '../../src/squad/formation';
import { examples } from '../examples';

const HERE = { latDeg: 47.4, lonDeg: 8.5 };
const flier = (id: number, northM: number, eastM: number, altM = 400): Flier => ({
  id,
  name: `drone-${id}`,
  place: offsetBy(HERE, northM, eastM),
  altM,
});
const LEADER = { ...flier(9, 0, 0), name: 'Merlin' };
const settings = (changes: Partial<FormationSettings>): FormationSettings => ({ ...USUAL_FORMATION, ...changes });

describe('the places of a formation', () => {
  it.each([
    [
      'line',
      0,
      [
        [0, 10, 2],
        [0, -10, 4],
        [0, 20, 6],
      ],
    ],
    [
      'column',
      90,
      [
        [0, -10, 2],
        [0, -20, 4],
        [0, -30, 6],
      ],
    ],
    [
      'v',
      0,
      [
        [-7.1, 7.1, 2],
        [-7.1, -7.1, 4],
        [-14.2, 14.2, 6],
      ],
    ],
    [
      'line',
      90,
      [
        [-10, 0, 2],
        [10, 0, 4],
        [-20, 0, 6],
      ],
    ],
  ] as const)('%s that looks to %i degrees', (shape, headingDeg, expected) => {
    const places = formationPlaces(settings({ shape, headingDeg, spacingM: 10 }), 3);
    expect(
      places.map(({ northM, eastM, upM }) => [northM, eastM, upM].map((one) => Math.round(one * 10) / 10 || 0)),
    ).toEqual(expected);
  });

  it('are apart from each other and from the leader for whatever can be set, or said not to be', () => {
    fc.assert(
      fc.property(
        fc.record({
          shape: fc.constantFrom('line' as const, 'v' as const, 'column' as const),
          spacingM: fc.double({ min: 8, max: 100, noNaN: true }),
          stepM: fc.double({ min: 0, max: 50, noNaN: true }),
          headingDeg: fc.integer({ min: 0, max: 359 }),
        }),
        fc.integer({ min: 1, max: 6 }),
        (chosen, count) => {
          const followers = Array.from({ length: count }, (_, at) => flier(at + 1, -200 - 30 * at, 15 * at));
          const { assigned, faults } = formationOf(LEADER, followers, chosen, 'metric');
          if (faults.length === 0) expect(assigned).toHaveLength(count);
          for (const [at, { place }] of assigned.entries()) {
            expect(placeFault(place, 'metric')).toBe('');
            for (const other of assigned.slice(at + 1)) expect(arePlacesApart(place, other.place)).toBe(true);
          }
        },
      ),
      { numRuns: examples(15, 80) },
    );
  });
});

describe('who takes which place', () => {
  it('is the one that stands on that side', () => {
    const [left, right] = [flier(1, -40, -30), flier(2, -40, 30)];
    const { assigned, faults } = formationOf(LEADER, [left, right], settings({ shape: 'line' }), 'metric');
    expect(faults).toEqual([]);
    expect(new Map(assigned.map(({ follower, place }) => [follower.id, Math.sign(place.eastM)]))).toEqual(
      new Map([
        [1, -1],
        [2, 1],
      ]),
    );
  });

  it('and who stands in the way sets off first', () => {
    // Both come from the south, to places one north of the other: the drone in front must leave first.
    const [front, back] = [flier(1, -80, 0), flier(2, -120, 0)];
    const { assigned, faults } = formationOf(
      LEADER,
      [back, front],
      settings({ shape: 'column', spacingM: 15, stepM: 0 }),
      'metric',
    );
    expect(faults).toEqual([]);
    expect(assigned.map(({ follower, place }) => [follower.id, Math.round(place.northM)])).toEqual([
      [1, -15],
      [2, -30],
    ]);
  });

  it('is nobody where the way leads past the leader, at its height', () => {
    const { faults } = formationOf(LEADER, [flier(1, 60, 0)], settings({ shape: 'column', stepM: 0 }), 'metric');
    expect(faults).toEqual(['On the straight way to its place drone-1 comes too near to Merlin.']);
    const high = formationOf(LEADER, [flier(1, 60, 0, 420)], settings({ shape: 'column', stepM: 20 }), 'metric');
    expect(high.faults).toEqual([]);
  });

  it('is nobody where there are too many, or no room for them', () => {
    const many = Array.from({ length: 7 }, (_, at) => flier(at + 1, -300, 20 * at));
    expect(formationOf(LEADER, many, settings({ spacingM: 10 }), 'metric').faults).toContain(
      '6 that follow are the most.',
    );
    const three = many.slice(0, 3);
    expect(formationOf(LEADER, three, settings({ shape: 'column', spacingM: 60 }), 'metric').faults[0]).toContain(
      'are the most',
    );
  });
});
