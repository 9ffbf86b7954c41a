import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { estimate, USUAL_FIGURES } from '../../src/plan/estimates';
import { FRAME } from '../../src/plan/frames';
import { distanceM, spotAt } from '../../src/plan/ground';
import { closestOfSegments, whenNear, type Solid } from '../../src/plan/near_ways';
import { planConflicts, type PlannedFlight } from '../../src/plan/plan_conflicts';
import { EMPTY_PLAN, spotOf, type Plan, type Spot } from '../../src/plan/plan_types';
import { timedPath, type TimedPath } from '../../src/plan/timed_path';
import { planItems, wireItem } from '../../src/plan/wire_items';
import { examples } from '../examples';

const BASE = spotOf(47, 8);
const WANTED = { horizontalM: 15, verticalM: 10 };
const SPEED = 5;

const at = (northM: number, eastM: number): Spot =>
  spotAt(BASE, Math.hypot(northM, eastM), (Math.atan2(eastM, northM) * 180) / Math.PI);
const item = (command: number, spot: Spot | null, z = 20, params: readonly (number | null)[] = [0, 0, 0, null]) =>
  wireItem(
    command,
    spot ? FRAME.GLOBAL_RELATIVE_ALT : FRAME.MISSION,
    params as [number, number, number, number | null],
    spot?.latE7 ?? 0,
    spot?.lonE7 ?? 0,
    z,
    1,
  );
const up = (z = 20) => item(CMD.TAKEOFF, { latE7: 0, lonE7: 0 }, z);
const to = (northM: number, eastM: number, z = 20, waitS = 0) =>
  item(CMD.WAYPOINT, at(northM, eastM), z, [waitS, 0, 0, null]);
const back = () => item(CMD.RETURN, null, 0);
const land = (northM: number, eastM: number) => item(CMD.LAND, at(northM, eastM), 0);

function planOf(home: Spot | null, items: ReturnType<typeof item>[], altM = 400): Plan {
  const defaults = { ...EMPTY_PLAN.defaults, speedMS: SPEED };
  const placed = planItems(items, 1);
  return { ...EMPTY_PLAN, home: home && { spot: home, altM }, items: placed, defaults, nextId: placed.length + 1 };
}
const flight = (name: string, plan: Plan, startS = 0): PlannedFlight => ({
  name,
  plan,
  figures: USUAL_FIGURES,
  startS,
});

const anyPlan = (offsetM: number): fc.Arbitrary<Plan> =>
  fc
    .record({
      legs: fc.array(
        fc.record({
          north: fc.integer({ min: -150, max: 150 }),
          east: fc.integer({ min: -150, max: 150 }),
          z: fc.integer({ min: 5, max: 45 }),
          waitS: fc.constantFrom(0, 0, 7),
        }),
        { minLength: 1, maxLength: 6 },
      ),
      end: fc.constantFrom('return', 'land', 'stay'),
    })
    .map(({ legs, end }) => {
      const flown = legs.map(({ north, east, z, waitS }) => to(north, east + offsetM, z, waitS));
      const last = legs.at(-1)!;
      const ending = end === 'return' ? [back()] : end === 'land' ? [land(last.north, last.east + offsetM)] : [];
      return planOf(at(0, offsetM), [up(), ...flown, ...ending]);
    });

/** Its position after this many seconds, metres above home; null on the ground. Independent of the code under test. */
function whereAt(path: TimedPath, atS: number): { spot: Spot; heightM: number } | null {
  if (atS < 0) return null;
  const piece = path.pieces.find(({ fromS, toS }) => atS >= fromS && atS < toS);
  if (!piece) {
    const last = path.pieces.at(-1)!;
    return atS >= last.toS && path.staysUp ? { spot: last.to, heightM: last.toHeightM } : null;
  }
  const part = (atS - piece.fromS) / (piece.toS - piece.fromS);
  const mixed = (from: number, to: number): number => from + (to - from) * part;
  if (Math.max(piece.fromHeightM, piece.toHeightM) <= 0.3) return null;
  return {
    spot: {
      latE7: mixed(piece.from.latE7, piece.to.latE7),
      lonE7: mixed(piece.from.lonE7, piece.to.lonE7),
    },
    heightM: mixed(piece.fromHeightM, piece.toHeightM),
  };
}

describe('a timed path', () => {
  it('takes as long as the estimate says', () => {
    fc.assert(
      fc.property(anyPlan(0), (plan) => {
        const path = timedPath(plan, USUAL_FIGURES);
        expect(path.seconds).toBeCloseTo(estimate(plan, USUAL_FIGURES).seconds, 6);
        for (const [index, piece] of path.pieces.entries()) {
          expect(piece.fromS).toBeCloseTo(path.pieces[index - 1]?.toS ?? 0, 6);
        }
      }),
    );
  });

  it('goes round circles and knows whether it is up at the end', () => {
    const circles = item(CMD.LOITER_TURNS, at(50, 0), 20, [2, 0, -20, 0]);
    const path = timedPath(planOf(BASE, [up(), circles]), USUAL_FIGURES);
    expect(path.pieces.at(-1)).toMatchObject({ reachM: 20 });
    expect(path.staysUp).toBe(true);
    expect(timedPath(planOf(BASE, [up(), to(50, 0), back()]), USUAL_FIGURES).staysUp).toBe(false);
    expect(timedPath(planOf(BASE, []), USUAL_FIGURES)).toMatchObject({ pieces: [], seconds: 0, staysUp: false });
  });
});

describe('plans flown at the same time', () => {
  it('conflict exactly where a simulation of both finds them near', () => {
    fc.assert(
      fc.property(anyPlan(0), anyPlan(40), fc.integer({ min: 0, max: 60 }), (one, other, startS) => {
        const flights = [flight('Alpha', one), flight('Bravo', other, startS)];
        const { conflicts, closest } = planConflicts(flights, WANTED);
        const near = conflicts.filter(({ kind }) => kind === 'near');
        const paths = [timedPath(one, USUAL_FIGURES), timedPath(other, USUAL_FIGURES)] as const;
        const overS = Math.max(paths[0].seconds, paths[1].seconds + startS);
        // Between two simulation steps they may come a metre nearer, horizontally and vertically: 0.1 s at 10 m/s.
        // Height differences right at the limit may fall on either side of it.
        let [surely, perhaps] = [Infinity, Infinity];
        for (let nowS = 0; nowS < overS; nowS += 0.1) {
          const [a, b] = [whereAt(paths[0], nowS), whereAt(paths[1], nowS - startS)];
          if (!a || !b) continue;
          const [apartM, aboveM] = [distanceM(a.spot, b.spot), Math.abs(a.heightM - b.heightM)];
          if (aboveM < WANTED.verticalM - 1e-6) surely = Math.min(surely, apartM);
          if (aboveM < WANTED.verticalM + 1) perhaps = Math.min(perhaps, apartM);
        }
        if (surely < WANTED.horizontalM - 0.1) expect(near).not.toEqual([]);
        if (near.length > 0) expect(perhaps).toBeLessThan(WANTED.horizontalM + 1.1);
        if (Number.isFinite(surely)) expect(closest[0]!.horizontalM).toBeLessThanOrEqual(surely + 0.1);
        if (closest[0]) expect(closest[0].horizontalM).toBeGreaterThan(perhaps - 1.2);
        if (near.length > 0) {
          const least = Math.min(...near.map(({ horizontalM }) => horizontalM));
          expect(least).toBeCloseTo(closest[0]!.horizontalM, 3);
        }
      }),
      { numRuns: examples(66, 400) },
    );
  });

  it('that fly at each other are told with names, time, distances and items', () => {
    const flights = [
      flight('Alpha', planOf(at(0, 0), [up(), to(0, 200), land(0, 200)])),
      flight('Bravo', planOf(at(0, 200), [up(22), to(0, 0, 22), land(0, 0)])),
    ];
    const [conflict, ...others] = planConflicts(flights, WANTED).conflicts.filter(({ kind }) => kind === 'near');
    expect(others).toEqual([]);
    expect(conflict).toMatchObject({ kind: 'near', severity: 'error', pair: [0, 1], seqs: [1, 1] });
    // Climbs of 8 s and 8.8 s, then 100 m at 5 m/s each, which meet in the middle.
    expect(conflict!.atS).toBeCloseTo(8.4 + 20, 0);
    expect(conflict!.verticalM).toBeCloseTo(2, 1);
    expect(distanceM(conflict!.spot, at(0, 100))).toBeLessThan(5);
    expect(conflict!.words).toMatch(
      /^Alpha and Bravo come within 0\.0 m of each other \(2\.0 m in height\) 28 s after the first start, for 3 s: Alpha on the way to item 2, Bravo to item 2\.$/,
    );
  });

  it('are kept apart by height, by distance, and by time', () => {
    const east = (z: number) => planOf(at(0, 0), [up(z), to(0, 200, z), to(0, 400, z), land(0, 400)]);
    const west = (z: number) => planOf(at(0, 395), [up(z), to(0, 200, z), to(0, 5, z), land(0, 5)]);
    const kinds = (...flights: PlannedFlight[]) => planConflicts(flights, WANTED).conflicts.map(({ kind }) => kind);
    expect(kinds(flight('A', east(20)), flight('B', west(20)))).toContain('near');
    expect(kinds(flight('A', east(20)), flight('B', planOf(at(60, 400), [up(), to(60, 5), land(60, 5)])))).toEqual([]);
    // At the ends each crosses the other's descent: a height difference of 15 m is not enough there.
    const high = planOf(at(80, 395), [up(45), to(80, 200, 45), to(0, 200, 45), to(80, 5, 45), land(80, 5)]);
    expect(kinds(flight('A', east(20)), flight('B', high))).toEqual([]);
    expect(kinds(flight('A', east(20)), flight('B', west(20), 400))).toEqual([]);
  });

  it('that cross one shortly after the other are warned of, and long after are not', () => {
    const east = planOf(at(0, -100), [up(), to(0, 100), land(0, 100)]);
    const north = planOf(at(-100, 0), [up(), to(100, 0), land(100, 0)]);
    const at10 = planConflicts([flight('Alpha', east), flight('Bravo', north, 10)], WANTED).conflicts;
    expect(at10.map(({ kind, severity }) => [kind, severity])).toEqual([['crossing', 'warning']]);
    expect(at10[0]!.gapS).toBeCloseTo(10, 0);
    expect(at10[0]!.words).toMatch(
      /^The ways of Alpha \(to item 2\) and Bravo \(to item 2\) come within .* only 10 s between them/,
    );
    const swapped = planConflicts([flight('Alpha', east, 10), flight('Bravo', north)], WANTED).conflicts;
    expect(swapped[0]!.words).toMatch(/^The ways of Bravo \(to item 2\) and Alpha/);
    expect(planConflicts([flight('Alpha', east), flight('Bravo', north, 60)], WANTED).conflicts).toEqual([]);
  });

  it('compare heights above the sea where every home is known', () => {
    const low = planOf(at(0, 0), [up(30), to(0, 200, 30), land(0, 200)], 400);
    const hill = planOf(at(0, 200), [up(30), to(0, 0, 30), land(0, 0)], 440);
    const near = (...flights: PlannedFlight[]) =>
      planConflicts(flights, WANTED).conflicts.filter(({ kind, atS }) => kind === 'near' && atS > 20 && atS < 50);
    expect(near(flight('A', low), flight('B', hill))).toEqual([]);
    const bare = { ...hill, home: null };
    const report = planConflicts([flight('A', low), flight('B', bare)], WANTED);
    expect(report.notes.join(' ')).toContain('as if all started equally high');
  });

  it('know who waits in the air at the end, and who circles', () => {
    const waits = planOf(at(0, 0), [up(), to(0, 100)]);
    const later = planOf(at(100, 100), [up(), to(0, 100), back()]);
    const report = planConflicts([flight('Alpha', waits), flight('Bravo', later, 300)], WANTED);
    expect(report.conflicts.map(({ kind }) => kind)).toContain('near');
    expect(report.notes).toContain(
      'Alpha stays in the air where its mission ends: it counts as being there until all are done.',
    );
    const circles = planOf(at(0, 0), [up(), item(CMD.LOITER_TURNS, at(0, 100), 20, [5, 0, 60, 0]), back()]);
    const passing = planOf(at(70, 200), [up(), to(70, 0), land(70, 0)]);
    expect(planConflicts([flight('A', circles), flight('B', passing)], WANTED).conflicts).not.toEqual([]);
  });

  it('are no trouble where there is one, or nothing to fly', () => {
    const plan = planOf(BASE, [up(), to(100, 0), back()]);
    expect(planConflicts([flight('Alpha', plan)], WANTED)).toEqual({ conflicts: [], closest: [], notes: [] });
    const empty = planConflicts([flight('Alpha', plan), flight('Bravo', planOf(BASE, []))], WANTED);
    expect(empty.conflicts).toEqual([]);
    expect(empty.notes).toEqual(['Bravo flies nowhere: nothing of it is checked.']);
    expect(planConflicts([], WANTED)).toEqual({ conflicts: [], closest: [], notes: [] });
  });

  it('of ten surveys are checked in a moment', () => {
    const survey = (eastM: number) => {
      const lines = Array.from({ length: 300 }, (_, line) =>
        to(line % 4 < 2 ? 0 : 300, eastM + 2 * Math.floor(line / 2)),
      );
      return planOf(at(0, eastM), [up(), ...lines, back()]);
    };
    const flights = Array.from({ length: 10 }, (_, number) => flight(`Drone ${number}`, survey(number * 340)));
    const beganMs = performance.now();
    const { conflicts } = planConflicts(flights, WANTED);
    expect(performance.now() - beganMs).toBeLessThan(5_000);
    expect(conflicts).toEqual([]);
  });
});

describe('two ways', () => {
  const solid: fc.Arbitrary<Solid> = fc.tuple(
    fc.integer({ min: -50, max: 50 }),
    fc.integer({ min: -50, max: 50 }),
    fc.integer({ min: -20, max: 20 }),
  );
  const segment = fc.record({ from: solid, to: solid });

  it('are nearest where trying all places finds them nearest', () => {
    fc.assert(
      fc.property(segment, segment, (one, other) => {
        const found = closestOfSegments(one, other, 1.5);
        const distance = (s: number, t: number): number =>
          Math.hypot(
            ...[0, 1, 2].map((axis) => {
              const p = one.from[axis]! + (one.to[axis]! - one.from[axis]!) * s;
              const q = other.from[axis]! + (other.to[axis]! - other.from[axis]!) * t;
              return (p - q) * (axis === 2 ? 1.5 : 1);
            }),
          );
        let least = Infinity;
        for (let s = 0; s <= 40; s += 1)
          for (let t = 0; t <= 40; t += 1) least = Math.min(least, distance(s / 40, t / 40));
        const ours = distance(...found.parts);
        expect(ours).toBeLessThanOrEqual(least + 1e-9);
        expect(Math.hypot(found.horizontalM, 1.5 * found.verticalM)).toBeCloseTo(ours, 6);
      }),
    );
  });

  it('without an end are near only as long as both distances are', () => {
    const moving = { place: [0, 100, 30], speed: [0, -10, -2] } as const;
    const near = whenNear(moving, 20, 10, 60);
    // Horizontally from 8 s to 12 s, vertically from 10 s to 20 s.
    expect(near).toMatchObject({ fromS: 10, toS: 12, closestS: 10, horizontalM: 0, verticalM: 10 });
    expect(whenNear(moving, 20, 10, 9)).toBeNull();
    expect(whenNear({ place: [0, 5, 0], speed: [0, 0, 0] }, 20, 10, 9)).toMatchObject({ fromS: 0, toS: 9 });
    expect(whenNear({ place: [0, 5, 11], speed: [0, 0, 0] }, 20, 10, 9)).toBeNull();
  });
});
