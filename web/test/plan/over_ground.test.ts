import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { heightProfile } from '../../src/plan/estimates';
import { flownPath, type GroundAt } from '../../src/plan/flown_path';
import { FRAME } from '../../src/plan/frames';
import { distanceM, spotAt } from '../../src/plan/ground';
import { between, groundFindings } from '../../src/plan/over_ground';
import { EMPTY_PLAN, spotOf, type Plan, type Spot, type WireItem } from '../../src/plan/plan_types';
import { SurveyFault } from '../../src/plan/survey/area';
import { followGround } from '../../src/plan/survey/follow_ground';
import { patternPreview, USUAL_SETTINGS } from '../../src/plan/survey/patterns';
import { planItems, wireItem } from '../../src/plan/wire_items';

const HOME = spotOf(47.4, 8.5);
const north = (metres: number): Spot => spotAt(HOME, metres, 0);
const northOf = (spot: Spot): number => ((spot.latE7 - HOME.latE7) / 1e7) * 111_195;
/** A ridge across the way, 60 m high, its top 300 m north of home, over land 400 m above the sea. */
const ridge: GroundAt = (spot) => 400 + 60 * Math.exp(-(((northOf(spot) - 300) / 80) ** 2));
const flat: GroundAt = () => 400;

const at = (spot: Spot, z: number, frame: number = FRAME.GLOBAL_RELATIVE_ALT): WireItem =>
  wireItem(CMD.WAYPOINT, frame, [0, 0, 0, null], spot.latE7, spot.lonE7, z);
const takeOff = wireItem(CMD.TAKEOFF, FRAME.GLOBAL_RELATIVE_ALT, [0, 0, 0, null], 0, 0, 30);
const planOf = (...items: WireItem[]): Plan => ({
  ...EMPTY_PLAN,
  // The sea level of the drone's own receiver is wrong by 12 m.
  home: { spot: HOME, altM: 412 },
  items: planItems(items, 1),
});
const LIMITS = { clearanceM: 10, returnHeightM: null };
const wordsOf = (plan: Plan, ground: GroundAt, limits = LIMITS as Parameters<typeof groundFindings>[3]) =>
  groundFindings(plan, flownPath(plan, ground), ground, limits).map(({ severity, words }) => `${severity}: ${words}`);

describe('the ground under a plan', () => {
  it('is named where a leg leads into it, from whichever reference its height is measured', () => {
    const into = 'error: The way to item 2 (Waypoint) is 30 m below the ground; 10 m is the least.';
    expect(wordsOf(planOf(takeOff, at(north(600), 30)), ridge)).toEqual([into]);
    expect(wordsOf(planOf(takeOff, at(north(600), 442, FRAME.GLOBAL)), ridge)).toEqual([into]);
    expect(wordsOf(planOf(takeOff, at(north(600), 30)), flat)).toEqual([]);
    expect(wordsOf(planOf(takeOff, at(north(300), 65)), ridge)[0]).toContain('only 5 m above the ground');
    expect(wordsOf(planOf(takeOff, at(north(300), 95)), ridge)).toEqual([]);
  });

  it('is followed by the autopilot between two points of the terrain frame', () => {
    const { GLOBAL_TERRAIN_ALT: over } = FRAME;
    const plan = planOf(takeOff, at(north(20), 30, over), at(north(600), 30, over));
    expect(wordsOf(plan, ridge)).toEqual([]);
    expect(flownPath(plan, ridge).legs.at(-1)!.followsGround).toBe(true);
    const hill = planOf(takeOff, at(north(300), 30, over));
    expect(flownPath(hill, ridge).legs.at(-1)!.toHeightM).toBeCloseTo(90, 0);
  });

  it('is checked on the way home at the return height', () => {
    const plan = planOf(takeOff, at(north(0.5), 80), at(north(600), 80), at(north(600), 30));
    expect(wordsOf(plan, ridge, { clearanceM: 10, returnHeightM: 15 })).toEqual([
      'warning: A return from item 4, at the return height of 15 m, is 30 m below the ground.',
    ]);
    expect(wordsOf(plan, ridge, { clearanceM: 10, returnHeightM: 75 })).toEqual([]);
  });

  it('is said to be unknown where it is, and nothing is said without it at home', () => {
    const partly: GroundAt = (spot) => (northOf(spot) > 100 ? null : 400);
    expect(wordsOf(planOf(takeOff, at(north(600), 30)), partly)).toEqual([
      'warning: The height of the ground is not known under all of the plan: there it is not checked.',
    ]);
    expect(wordsOf(planOf(takeOff, at(north(600), 30)), () => null)).toEqual([]);
    expect(wordsOf(planOf(takeOff, at(north(600), 30)), () => undefined)).toEqual([]);
  });

  it('is in the height profile', () => {
    const path = flownPath(planOf(takeOff, at(north(600), 30)), ridge);
    const profile = heightProfile(path, 200, (spot) => ridge(spot)! - 400);
    expect(Math.max(...profile.map(({ groundM }) => groundM!))).toBeCloseTo(60, 0);
    expect(heightProfile(path).every(({ groundM }) => groundM === null)).toBe(true);
  });
});

describe('a survey at a constant height above the ground', () => {
  const settings = { heightM: 50, toleranceM: 2, home: HOME, ground: ridge };

  it('has a waypoint wherever the ground departs, and none where it is even', () => {
    const followed = followGround([at(north(0), 50), at(north(1200), 50)], settings);
    expect(followed.length).toBeGreaterThan(6);
    expect(followed.length).toBeLessThan(30);
    expect(followed.every(({ frame }) => frame === FRAME.GLOBAL_RELATIVE_ALT)).toBe(true);
    for (const [index, item] of followed.entries()) {
      const next = followed[index + 1];
      if (!next) continue;
      const [from, to] = [item, next].map(({ x, y }) => ({ latE7: x, lonE7: y })) as [Spot, Spot];
      for (let share = 0; share <= 1; share += 0.05) {
        const above = item.z + (next.z - item.z) * share - (ridge(between(from, to, share))! - 400);
        expect(Math.abs(above - 50)).toBeLessThan(2.3);
      }
    }
    expect(followGround([at(north(0), 50), at(north(1200), 50)], { ...settings, ground: flat })).toHaveLength(2);
  });

  it('keeps what is not a waypoint in its place', () => {
    const trigger = wireItem(CMD.TRIGGER_DISTANCE, FRAME.MISSION, [20, 0, 1, 0], 0, 0, 0);
    const followed = followGround([at(north(0), 50), trigger, at(north(600), 50)], settings);
    expect(followed[1]).toEqual(trigger);
    expect(followed.filter(({ command }) => command === CMD.TRIGGER_DISTANCE)).toHaveLength(1);
    expect(distanceM({ latE7: followed.at(-1)!.x, lonE7: followed.at(-1)!.y }, north(600))).toBeLessThan(0.1);
  });

  it('is refused in words where the ground or home is not known', () => {
    const items = [at(north(0), 50), at(north(600), 50)];
    const partly: GroundAt = (spot) => (northOf(spot) > 100 ? null : 400);
    expect(() => followGround(items, { ...settings, ground: partly })).toThrow(SurveyFault);
    expect(() => followGround(items, { ...settings, home: null })).toThrow('planned home');
    expect(() => followGround(items, { ...settings, ground: () => undefined })).toThrow('being loaded');
    expect(() => followGround(items, { ...settings, toleranceM: 0 })).toThrow('tolerance');
  });

  it('is what the planner previews', () => {
    const area = [north(100), spotAt(north(100), 200, 90), spotAt(north(500), 200, 90), north(500)];
    const chosen = { ...USUAL_SETTINGS, overGround: true, camera: 'none', spacingM: 50 };
    const preview = (ground: GroundAt) =>
      patternPreview('survey', area, 0, chosen, FRAME.GLOBAL_RELATIVE_ALT, 'ardupilot', { home: HOME, ground });
    expect(preview(ridge).items.length).toBeGreaterThan(preview(flat).items.length * 2);
    expect(preview(() => null).fault).toContain('not known everywhere');
  });
});
