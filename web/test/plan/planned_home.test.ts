import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { insertItems, newItem } from '../../src/plan/edits';
import { spotAt } from '../../src/plan/ground';
import { EMPTY_PLAN, spotOf, type PlannedHome } from '../../src/plan/plan_types';
import { beginAt, beginsElsewhere } from '../../src/plan/planned_home';

const HERON = spotOf(47, 8);
const KITE = spotAt(HERON, 200, 90);
const FIELD = spotAt(HERON, 500, 0);
const at = (spot = HERON): PlannedHome => ({ spot, altM: 400 });

describe('the home of a plan', () => {
  it('is that of the drone that it is for, unless somebody put it elsewhere', () => {
    expect(beginsElsewhere(null, KITE, [HERON])).toBe(true);
    expect(beginsElsewhere(at(HERON), KITE, [HERON])).toBe(true);
    expect(beginsElsewhere(at(spotAt(HERON, 0.4, 10)), KITE, [HERON])).toBe(true);
    expect(beginsElsewhere(at(KITE), KITE, [HERON])).toBe(false);
    expect(beginsElsewhere(at(FIELD), KITE, [HERON])).toBe(false);
    // Two that start side by side.
    expect(beginsElsewhere(at(HERON), HERON, [HERON])).toBe(false);
  });

  it('takes a take-off that stands on it along, and nothing else', () => {
    const { defaults } = EMPTY_PLAN;
    const items = [
      newItem(defaults, CMD.TAKEOFF, HERON),
      newItem(defaults, CMD.TAKEOFF, FIELD),
      newItem(defaults, CMD.WAYPOINT, HERON),
    ];
    const plan = insertItems(0, items).apply({ ...EMPTY_PLAN, home: at(HERON) });
    const moved = beginAt({ spot: KITE, altM: 410 }).apply(plan);
    expect(moved.home).toEqual({ spot: KITE, altM: 410 });
    expect(moved.items.map(({ x, y }) => ({ latE7: x, lonE7: y }))).toEqual([KITE, FIELD, HERON]);
    expect(beginAt(at(KITE)).apply(EMPTY_PLAN).home).toEqual(at(KITE));
  });
});
