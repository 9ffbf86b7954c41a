import { describe, expect, it } from 'vitest';

import { CATALOGUE, CMD } from '../../src/plan/catalogue';
import { newItem } from '../../src/plan/edits';
import { itemFaults, rallyFaults, shapeFaults } from '../../src/plan/field_checks';
import { EMPTY_PLAN, spotOf, type PlanItem } from '../../src/plan/plan_types';

const HERE = spotOf(47.39, 8.54);

const item = (command: number, change: Partial<PlanItem> = {}): PlanItem => ({
  ...newItem(EMPTY_PLAN.defaults, command, HERE),
  id: 1,
  jumpTo: command === CMD.JUMP ? 1 : null,
  ...change,
});

const words = (one: PlanItem): string[] => itemFaults(one, 4).map((fault) => `${fault.field}: ${fault.words}`);

describe('the fields of an item', () => {
  it.each([...CATALOGUE.values()].map((spec) => [spec.label, spec.command] as const))(
    'are right as a new %s has them',
    (_label, command) => expect(words(item(command))).toEqual([]),
  );

  it.each<[string, PlanItem]>([
    ['p1: Wait at the waypoint: -1 s is outside of 0 to 65535 s.', item(CMD.WAYPOINT, { params: [-1, 0, 0, null] })],
    ['p4: Heading: 400 deg is outside of -360 to 360 deg.', item(CMD.WAYPOINT, { params: [0, 0, 0, 400] })],
    ['p1: Wait at the waypoint: a number is needed.', item(CMD.WAYPOINT, { params: [null, 0, 0, null] })],
    ['p2: Hour (UTC), -1: any: a whole number is needed.', item(CMD.NAV_DELAY, { params: [-1, 2.5, 0, 0] })],
    [
      'p3: Direction: 2 is none of -1 (counter-clockwise), 0 (shortest), 1 (clockwise).',
      item(CMD.CONDITION_YAW, { params: [0, 0, 2, 0] }),
    ],
    ['p1: To item: there is no item 8, there are 4.', item(CMD.JUMP, { jumpTo: null, params: [7, 1, 0, 0] })],
    ['p1: To item: choose one.', item(CMD.JUMP, { jumpTo: null, params: [-1, 1, 0, 0] })],
    ['frame: Height measured from: frame 2 is not one of places on earth.', item(CMD.WAYPOINT, { frame: 2 })],
    ['place: Place: it has none yet (0, 0).', item(CMD.WAYPOINT, { x: 0, y: 0 })],
    [
      'place: Place: latitude is from -90 to 90 degrees, longitude from -180 to 180.',
      item(CMD.WAYPOINT, { x: 900_000_001 }),
    ],
    ['height: Height: 20000 m is outside of -500 to 10000 m.', item(CMD.WAYPOINT, { z: 20_000 })],
    ['height: Height: a number is needed.', item(CMD.WAYPOINT, { z: NaN })],
    ['command: Command: a whole number from 0 to 65535 is needed.', item(70_000)],
    ['p2: Parameter 2: that is not a number.', item(40_000, { params: [0, Infinity, 0, 0] })],
  ])('are told in words: %s', (expected, one) => expect(words(one)).toEqual([expected]));

  it('may be without a place where the drone takes the one that it is at', () => {
    expect(words(item(CMD.LAND, { x: 0, y: 0 }))).toEqual([]);
    expect(words(item(CMD.TAKEOFF, { x: 0, y: 0, frame: 2 }))).toEqual([]);
  });

  it('of a command that is not known here are left alone', () => {
    expect(words(item(40_001, { frame: 2, x: 7, y: 8, params: [1e6, null, -5, 0] }))).toEqual([]);
  });
});

describe('the parts of a fence and the rally points', () => {
  it('are checked too', () => {
    const circle = { shape: 'circle', id: 1, inclusion: true, group: 0, frame: 0, centre: HERE, radiusM: 50 } as const;
    expect(shapeFaults(circle)).toEqual([]);
    expect(shapeFaults({ ...circle, radiusM: 0 })).toEqual(['Radius: more than 0 and at most 100000 m are needed.']);
    expect(shapeFaults({ ...circle, radiusM: NaN })).toHaveLength(1);
    const polygon = { shape: 'polygon', id: 1, inclusion: true, group: 0, frame: 0, corners: [HERE, HERE] } as const;
    expect(shapeFaults(polygon)).toEqual(['A polygon has three corners at least.']);
    expect(rallyFaults({ id: 1, frame: 3, spot: HERE, heightM: 30 })).toEqual([]);
    expect(rallyFaults({ id: 1, frame: 3, spot: spotOf(0, 0), heightM: 30_000 })).toHaveLength(2);
  });
});
