import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { distanceM, spotAt } from '../../src/plan/ground';
import { EMPTY_PLAN, spotOf, type Spot } from '../../src/plan/plan_types';
import { areaM2 } from '../../src/plan/survey/area';
import { planItems, wireItem } from '../../src/plan/wire_items';
import {
  listWords,
  MAX_MEMBERS,
  onGround,
  squadPlan,
  USUAL_SQUAD,
  type Member,
  type SquadSettings,
} from '../../src/squad/squad_plan';

const BASE = spotOf(47, 8);
const at = (northM: number, eastM: number): Spot =>
  spotAt(BASE, Math.hypot(northM, eastM), (Math.atan2(eastM, northM) * 180) / Math.PI);
const member = (id: number, spot: Spot | null = at(0, 20 * id), name = `Drone ${id}`): Member => ({
  id,
  name,
  home: spot && { spot, altM: 400 },
  autopilot: 'ardupilot',
});
/** 300 m wide, 200 m high, 60 m north of the drones. */
const FIELD = [at(60, -100), at(260, -100), at(260, 200), at(60, 200)];
const settings = (changes: Partial<SquadSettings> = {}): SquadSettings => ({ ...USUAL_SQUAD, ...changes });
const THREE = [member(1), member(2), member(3)];
const waypoints = (items: readonly { command: number; x: number; y: number }[]): Spot[] =>
  items.filter(({ command }) => command === CMD.WAYPOINT).map(({ x, y }) => ({ latE7: x, lonE7: y }));

describe('an area split among drones', () => {
  it('is a strip of the same size for each, flown in turn of where they stand, and nobody comes near another', () => {
    const { parts, report, fault } = squadPlan(THREE, { area: FIELD }, settings());
    expect(fault).toBe('');
    expect(parts.map(({ member: { id } }) => id)).toEqual([1, 2, 3]);
    for (const { area } of parts) expect(areaM2(area) / areaM2(FIELD)).toBeCloseTo(1 / 3, 2);
    const middles = parts.map(({ area }) => area.reduce((sum, { lonE7 }) => sum + lonE7, 0) / area.length);
    expect([...middles].sort((a, b) => a - b)).toEqual(middles);
    expect(report.conflicts).toEqual([]);
    expect(report.closest.length).toBe(3);
    for (const { horizontalM } of report.closest) expect(horizontalM).toBeGreaterThan(USUAL_SQUAD.wanted.horizontalM);
    expect(parts.flatMap(({ findings }) => findings.filter(({ severity }) => severity === 'error'))).toEqual([]);
  });

  it('covers the whole of it', () => {
    const { parts } = squadPlan(THREE, { area: FIELD }, settings());
    const lines = parts.flatMap(({ plan }) => waypoints(plan.items));
    // Anywhere in the field, a line is at most half the line distance away (plus a little at the edge).
    for (let north = 75; north < 260; north += 20) {
      for (let east = -90; east < 200; east += 20) {
        const near = lines.some((spot, index) => {
          const next = lines[index + 1];
          if (!next) return false;
          const [from, to] = [spot, next].sort((a, b) => a.latE7 - b.latE7) as [Spot, Spot];
          const here = at(north, east);
          return (
            from.latE7 <= here.latE7 &&
            here.latE7 <= to.latE7 &&
            distanceM(here, { ...here, lonE7: from.lonE7 }) <= 13.5
          );
        });
        expect(near, `${north} m north, ${east} m east`).toBe(true);
      }
    }
  });

  it('begins with a take-off and ends with a return, at the height and speed that were set', () => {
    const { parts } = squadPlan(THREE, { area: FIELD }, settings({ heightM: 55, stepM: 5, speedMS: 8, triggerM: 20 }));
    for (const [index, { plan, startS }] of parts.entries()) {
      const commands = plan.items.map(({ command }) => command);
      expect(commands[0]).toBe(CMD.TAKEOFF);
      expect(commands.at(-1)).toBe(CMD.RETURN);
      expect(commands).toContain(CMD.TRIGGER_DISTANCE);
      expect(plan.items[1]!.params[1]).toBe(8);
      expect(new Set(plan.items.filter(({ command }) => command === CMD.WAYPOINT).map(({ z }) => z))).toEqual(
        new Set([55 + 5 * index]),
      );
      expect(startS).toBe(5 * index);
    }
  });

  it('is shared another way where one would climb under another', () => {
    // One behind the other, and the field ahead of both: the rear drone flies over the front one.
    const row = [member(1, at(0, 0)), member(2, at(20, 0)), member(3, at(10, 17))];
    const field = [at(60, -60), at(145, -60), at(145, 155), at(60, 155)];
    const fast = settings({ heightM: 25, spacingM: 40, speedMS: 10, startEveryS: 2 });
    const { parts, report } = squadPlan(row, { area: field }, fast);
    expect(report.conflicts.filter(({ severity }) => severity === 'error')).toEqual([]);
    expect(new Set(parts.map(({ member: { id } }) => id))).toEqual(new Set([1, 2, 3]));
    expect(parts.map(({ startS }) => startS)).toEqual([0, 2, 4]);
  });

  it('is told to conflict where the drones stand on each other', () => {
    const close = [member(1, at(0, 0), 'Alpha'), member(2, at(0, 4), 'Bravo')];
    const { report } = squadPlan(close, { area: FIELD }, settings({ startEveryS: 0 }));
    expect(report.conflicts[0]!.words).toContain('Alpha and Bravo');
  });
});

describe('the same flight above each other', () => {
  it('is the same lines, each so much higher', () => {
    const { parts, report } = squadPlan(THREE, { area: FIELD }, settings({ mode: 'stack', stepM: 15 }));
    const [first, ...others] = parts;
    for (const [index, other] of others.entries()) {
      expect(waypoints(other.plan.items)).toEqual(waypoints(first!.plan.items));
      expect(other.plan.items[0]!.z).toBe(40 + 15 * (index + 1));
    }
    expect(report.conflicts.filter(({ severity }) => severity === 'error')).toEqual([]);
  });

  it('conflicts where they are not far enough above each other', () => {
    const row = [1, 2, 3].map((id) => member(id, at(0, 8 * id)));
    const { report } = squadPlan(row, { area: FIELD }, settings({ mode: 'stack', stepM: 4, startEveryS: 1 }));
    expect(report.conflicts.some(({ kind }) => kind === 'near')).toBe(true);
  });

  it('takes a plan from elsewhere, and leaves its landing where it is', () => {
    const rows = [
      wireItem(CMD.TAKEOFF, 3, [0, 0, 0, null], 0, 0, 30),
      wireItem(CMD.WAYPOINT, 3, [0, 0, 0, null], at(100, 0).latE7, at(100, 0).lonE7, 30),
      wireItem(CMD.LAND, 3, [0, 0, 0, null], at(120, 0).latE7, at(120, 0).lonE7, 0),
    ];
    const plan = { ...EMPTY_PLAN, items: planItems(rows, 1), nextId: 4 };
    const { parts } = squadPlan(THREE, { plan }, settings({ mode: 'stack', stepM: 20 }));
    expect(parts.map(({ plan: { items } }) => items.map(({ z }) => z))).toEqual([
      [30, 30, 0],
      [50, 50, 0],
      [70, 70, 0],
    ]);
    expect(parts.map(({ plan: { home } }) => home)).toEqual(THREE.map(({ home }) => home));
  });
});

describe('no plan', () => {
  it.each([
    ['without drones', [], FIELD, ''],
    ['without an area', THREE, FIELD.slice(0, 2), ''],
    [
      'where nobody knows where one is',
      [member(1), member(2, null, 'Kite')],
      FIELD,
      'The position of Kite is not known.',
    ],
    [
      'for more than can be',
      Array.from({ length: MAX_MEMBERS + 1 }, (_, id) => member(id)),
      FIELD,
      '20 drones are the most for one job.',
    ],
    [
      'over an outline that crosses itself',
      THREE,
      [FIELD[0]!, FIELD[2]!, FIELD[1]!, FIELD[3]!],
      'The outline of the area crosses itself: move its corners until it does not.',
    ],
  ] as const)('%s', (_, members, area, fault) => {
    expect(squadPlan(members, { area }, settings())).toMatchObject({ parts: [], fault });
  });

  it('names are listed as people do', () => {
    expect([[], ['A'], ['A', 'B'], ['A', 'B', 'C']].map(listWords)).toEqual(['', 'A', 'A and B', 'A, B and C']);
  });
});

describe('a squad over hills', () => {
  const northM = (spot: Spot): number => ((spot.latE7 - BASE.latE7) / 1e7) * 111_195;
  /** A ridge 60 m high across the field, its top 160 m north of where they stand. */
  const ridge = (spot: Spot): number => 400 + 60 * Math.exp(-(((northM(spot) - 160) / 60) ** 2));
  const job = { area: FIELD };
  const errorsOf = ({ parts }: ReturnType<typeof squadPlan>): string[] =>
    parts.flatMap(({ findings }) => findings.filter(({ severity }) => severity === 'error').map(({ words }) => words));

  it('is told which ways lead into them', () => {
    const flat = squadPlan(THREE, job, settings());
    expect(errorsOf(flat)).toEqual([]);
    const errors = errorsOf(onGround(flat, job, settings(), ridge));
    expect(errors.length).toBeGreaterThanOrEqual(3);
    expect(errors[0]).toMatch(/below the ground|above the ground/);
    expect(onGround(flat, job, settings(), () => null)).toEqual(flat);
  });

  it('keeps its height above them, from home and back, each drone its own', () => {
    const wanted = settings({ overGround: true, stepM: 5 });
    const flat = squadPlan(THREE, job, wanted);
    const laid = onGround(flat, job, wanted, ridge);
    expect(laid.fault).toBe('');
    expect(errorsOf(laid)).toEqual([]);
    expect(laid.parts.map(({ member: { id }, number, area }) => [id, number, area])).toEqual(
      flat.parts.map(({ member: { id }, number, area }) => [id, number, area]),
    );
    for (const [index, { plan, member: own }] of laid.parts.entries()) {
      const way = plan.items.filter(({ command }) => command === CMD.WAYPOINT);
      for (const [at, { x, y, z }] of way.entries()) {
        const spot = { latE7: x, lonE7: y };
        expect(z + ridge(own.home!.spot) - ridge(spot)).toBeCloseTo(40 + 5 * index, 1);
        const next = way[at + 1];
        if (!next) continue;
        const middle = { latE7: Math.round((x + next.x) / 2), lonE7: Math.round((y + next.y) / 2) };
        const aboveM = (z + next.z) / 2 + ridge(own.home!.spot) - ridge(middle);
        expect(Math.abs(aboveM - 40 - 5 * index)).toBeLessThan(wanted.toleranceM + 1);
      }
      expect(distanceM({ latE7: way.at(-1)!.x, lonE7: way.at(-1)!.y }, own.home!.spot)).toBeLessThan(0.1);
      expect(plan.items.map(({ command }) => command).at(-1)).toBe(CMD.RETURN);
      expect(plan.items[0]!.command).toBe(CMD.TAKEOFF);
    }
    expect(laid.report.conflicts).toEqual([]);
  });

  it('waits for the heights of the ground', () => {
    const wanted = settings({ overGround: true });
    const flat = squadPlan(THREE, job, wanted);
    expect(onGround(flat, job, wanted, () => undefined).fault).toContain('being loaded');
  });
});
