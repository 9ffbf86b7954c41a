import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { newItem } from '../../src/plan/edits';
import { estimate, heightProfile, USUAL_FIGURES } from '../../src/plan/estimates';
import { FenceCheck } from '../../src/plan/fence_crossings';
import { flownOrder, flownPath } from '../../src/plan/flown_path';
import { distanceM, spotAt } from '../../src/plan/ground';
import { checksBadge, planChecks, type CheckLimits, type Finding } from '../../src/plan/plan_checks';
import { EMPTY_PLAN, spotOf, type FenceShape, type Plan, type Spot, type WireItem } from '../../src/plan/plan_types';
import { planItems } from '../../src/plan/wire_items';

const HOME = spotOf(47.39, 8.54);
const north = (metres: number): Spot => spotAt(HOME, metres, 0);
const east = (metres: number): Spot => spotAt(HOME, metres, 90);

const item = (command: number, spot: Spot | null = null, change: Partial<WireItem> = {}): WireItem => ({
  ...newItem(EMPTY_PLAN.defaults, command, spot),
  ...change,
});
const up = item(CMD.TAKEOFF, null, { z: 25 });
const to = (spot: Spot, change: Partial<WireItem> = {}): WireItem => item(CMD.WAYPOINT, spot, { z: 25, ...change });
const jump = (target: number, times: number): WireItem => item(CMD.JUMP, null, { params: [target, times, 0, 0] });
const back = item(CMD.RETURN);

const planOf = (items: readonly WireItem[], change: Partial<Plan> = {}): Plan => ({
  ...EMPTY_PLAN,
  home: { spot: HOME, altM: 400 },
  items: planItems(items, 1),
  nextId: items.length + 1,
  ...change,
});

const circle = (centre: Spot, radiusM: number, inclusion: boolean): FenceShape => ({
  shape: 'circle',
  id: 100,
  inclusion,
  group: 0,
  frame: 0,
  centre,
  radiusM,
});
const polygon = (corners: readonly Spot[], inclusion: boolean): FenceShape => ({
  shape: 'polygon',
  id: 101,
  inclusion,
  group: 0,
  frame: 0,
  corners,
});
const fenced = (...shapes: FenceShape[]): Partial<Plan> => ({ fence: { shapes, returnPoint: null } });

describe('the order that items are flown in', () => {
  it('follows jumps, as often as they say', () => {
    const plan = planOf([up, to(north(10)), to(north(20)), jump(1, 2), back]);
    expect(flownOrder(plan)).toEqual({ steps: [0, 1, 2, 1, 2, 1, 2, 4], ending: 'ends', last: 4 });
  });

  it('ends at a return, waits where it is told to, and goes round for ever only once', () => {
    expect(flownOrder(planOf([up, back, to(north(10))])).steps).toEqual([0, 1]);
    expect(flownOrder(planOf([up, item(CMD.LOITER_UNLIMITED, HOME), back]))).toMatchObject({
      ending: 'waits',
      last: 1,
    });
    expect(flownOrder(planOf([up, to(north(10)), jump(1, -1), back]))).toEqual({
      steps: [0, 1],
      ending: 'for-ever',
      last: 2,
    });
  });

  it('gives up on what does not end', () => {
    expect(flownOrder(planOf([to(north(10)), jump(0, 30_000)])).ending).toBe('too-long');
    expect(flownOrder(planOf([jump(1, 32_000), jump(0, 32_000)])).ending).toBe('too-long');
    expect(flownOrder(planOf([]))).toEqual({ steps: [], ending: 'ends', last: null });
  });
});

describe('an estimate', () => {
  const figures = { ...USUAL_FIGURES, batteryPerMin: 6 };
  const speed = item(CMD.CHANGE_SPEED, null, { params: [1, 10, -1, 0] });

  it('adds up lengths, speeds, climbs, turns and waits', () => {
    const wait = to(north(200), { params: [5, 0, 0, null] });
    const result = estimate(planOf([up, to(north(100)), speed, wait, back]), figures);
    expect(result.lengthM).toBeCloseTo(400, 0);
    // Climb 10, out 20, on 10 and 5 of waiting, turn 4, back 20, descent 16.7.
    expect(result.seconds).toBeCloseTo(10 + 20 + 10 + 5 + 4 + 20 + 25 / 1.5, 0);
    expect(result.batteryPercent).toBeCloseTo(result.seconds / 10, 6);
    expect(result).toMatchObject({ highestM: 25, ending: 'ends', notes: [], coveredM2: null });
  });

  it('knows circles, delays, and what it leaves out', () => {
    const circles = item(CMD.LOITER_TURNS, HOME, { z: 25, params: [2, 0, -20, 0] });
    const base = estimate(planOf([up]), figures).seconds;
    expect(estimate(planOf([up, circles]), figures).seconds - base).toBeCloseTo((2 * 2 * Math.PI * 20) / 5, 1);
    const delay = item(CMD.NAV_DELAY, null, { params: [30, -1, -1, -1] });
    expect(estimate(planOf([up, delay]), figures).seconds - base).toBe(30);
    const clock = item(CMD.NAV_DELAY, null, { params: [-1, 12, 0, 0] });
    expect(estimate(planOf([up, clock]), figures).notes[0]).toContain('Item 2 waits for a time of day');
    expect(estimate(planOf([up, to(north(9)), jump(1, -1)]), figures).notes[0]).toContain('for ever');
    expect(estimate(planOf([up], { home: null }), figures).notes[0]).toContain('no home');
  });

  it('takes the slower of flying and climbing', () => {
    const level = estimate(planOf([up, to(north(100))]), figures).seconds;
    const climbing = estimate(planOf([up, to(north(100), { z: 125 })]), figures).seconds;
    expect(climbing - level).toBeCloseTo(40 - 20, 0);
  });

  it('counts pictures and the strip that they cover', () => {
    const on = item(CMD.TRIGGER_DISTANCE, null, { params: [20, 0, 1, 0] });
    const off = item(CMD.TRIGGER_DISTANCE, null, { params: [0, 0, 0, 0] });
    const plan = planOf([up, to(north(50)), on, to(north(150)), off, to(north(400))]);
    const result = estimate(plan, { ...figures, stripM: 30 });
    expect(result.coveredM2! / 3_000).toBeCloseTo(1, 2);
    expect(result.pictures).toBeGreaterThanOrEqual(5);
    expect(result.pictures).toBeLessThanOrEqual(6);
  });

  it('has a profile of heights, every corner of it, of what is flown', () => {
    const amsl = to(north(200), { frame: 0, z: 460 });
    const path = flownPath(planOf([up, to(north(100)), amsl, item(CMD.LAND, north(300))]));
    const profile = heightProfile(path, 50);
    expect(profile[0]).toMatchObject({ alongM: 0, heightM: 0 });
    expect(profile.at(-1)!.heightM).toBe(0);
    expect(profile.at(-1)!.alongM).toBeCloseTo(300, 0);
    expect(Math.max(...profile.map((point) => point.heightM))).toBe(60);
    expect(profile.length).toBeLessThan(70);
    const middle = profile.find((point) => Math.abs(point.alongM - 150) < 4)!;
    expect(Math.abs(middle.heightM - (25 + (35 * (middle.alongM - 100)) / 100))).toBeLessThan(0.5);
  });
});

describe('the fence', () => {
  const area = [spotAt(HOME, 200, 45), spotAt(HOME, 200, 135), spotAt(HOME, 200, 225), spotAt(HOME, 200, 315)];

  it('is left where its border is crossed, however short the piece outside', () => {
    const check = new FenceCheck([polygon(area, true)], HOME);
    expect(check.on({ from: HOME, to: north(141) })).toBeNull();
    expect(check.on({ from: HOME, to: north(142) })).toBe('outside');
    expect(check.at(north(142))).toBe('outside');
    // Out over a bay and in again: both ends are inside.
    const bay = [spotAt(HOME, 200, 0), spotAt(HOME, 200, 120), spotAt(HOME, 5, 180), spotAt(HOME, 200, 240)];
    const concave = new FenceCheck([polygon(bay, true)], HOME);
    const [left, right] = [spotAt(HOME, 130, 250), spotAt(HOME, 130, 110)];
    expect([concave.at(left), concave.at(right)]).toEqual([null, null]);
    expect(concave.on({ from: left, to: right })).toBe('outside');
  });

  it('forbids what is in the middle of a way', () => {
    const check = new FenceCheck([circle(north(100), 5, false)], HOME);
    expect(check.on({ from: HOME, to: north(200) })).toBe('forbidden');
    expect(check.on({ from: HOME, to: north(94) })).toBeNull();
    expect(check.on({ from: spotAt(HOME, 6, 90), to: spotAt(north(200), 6, 90) })).toBeNull();
  });

  it('of several areas tells apart leaving all and leaving one', () => {
    const check = new FenceCheck([circle(HOME, 100, true), circle(north(150), 100, true)], HOME);
    expect(check.on({ from: HOME, to: north(150) })).toBe('outside-one');
    expect(check.on({ from: HOME, to: north(300) })).toBe('outside');
    expect(check.on({ from: north(70), to: north(80) })).toBeNull();
  });
});

describe('the checks before an upload', () => {
  const limits: CheckLimits = { autopilot: 'ardupilot', highestM: 120, farthestM: 1_000 };
  const reported = (plan: Plan, change: Partial<CheckLimits> = {}): string[] =>
    planChecks(plan, { ...limits, ...change }).map(({ severity, words }) => `${severity}: ${words}`);
  const good = [up, to(north(100)), to(east(100)), back];

  it('have nothing to say of a plan that is well', () => {
    expect(reported(planOf(good))).toEqual([]);
    expect(reported(planOf(good, fenced(circle(HOME, 150, true), circle(east(-100), 40, false))))).toEqual([]);
    expect(reported(planOf([]))).toEqual([]);
    expect(reported(planOf([up, to(north(100)), jump(1, 3), back]))).toEqual([]);
  });

  it.each<[string, Plan, Partial<CheckLimits>?]>([
    ['error: Item 2 (Waypoint) is 1500 m from home; 1000 m is the most.', planOf([up, to(north(1_500)), back])],
    ['error: Item 2 (Waypoint) is 130 m above home; 120 m is the most.', planOf([up, to(north(9), { z: 130 }), back])],
    [
      'error: Item 2 (Waypoint) is 150 m above home; 120 m is the most.',
      planOf([up, to(north(9), { frame: 0, z: 550 }), back]),
    ],
    [
      'warning: Item 2 (Waypoint) is -10 m above home: on the ground or below it.',
      planOf([up, to(north(9), { frame: 0, z: 390 }), back]),
    ],
    [
      'warning: There is no take-off: the drone must be in the air when the mission begins.',
      planOf([to(north(100)), back]),
    ],
    [
      'warning: Item 2 (Take-off) comes after item 1, which flies somewhere already.',
      planOf([to(north(100)), up, back]),
    ],
    [
      'warning: Item 2 (Waypoint) is the last: the drone stays there, in the air, until somebody commands it.',
      planOf([up, to(north(100))]),
    ],
    ['warning: Item 3 (Waypoint) is never reached.', planOf([up, back, to(north(100))])],
    ['warning: Item 3 (Waypoint) is at the same place as item 2.', planOf([up, to(north(9)), to(north(9)), back])],
    ['error: Item 3 (Jump) jumps to itself.', planOf([up, to(north(9)), jump(2, 2), back])],
    [
      'error: Item 4 (Jump) goes round to item 3 without flying anywhere.',
      planOf([up, to(north(9)), item(CMD.CHANGE_SPEED), jump(2, 5), back]),
    ],
    [
      'error: Item 3 (Jump) is not right. To item: there is no item 41, there are 4.',
      planOf([up, to(north(9)), jump(40, 1), back]),
    ],
    [
      'error: Item 2 (Loiter (turns)) is not a part of missions of PX4.',
      planOf([up, item(CMD.LOITER_TURNS, north(9), { z: 25 }), back]),
      { autopilot: 'px4' },
    ],
    [
      'warning: Item 2 (Command 4242) is not known here: nothing of it is checked.',
      planOf([up, item(4242), to(north(9)), back]),
    ],
    [
      'error: The way to item 2 (Waypoint) leaves the fence.',
      planOf([up, to(north(100)), to(HOME, { z: 30 }), back], fenced(circle(HOME, 50, true))),
    ],
    [
      'error: The way to item 3 (Waypoint) goes where the fence forbids it.',
      planOf(good, fenced(circle(spotAt(HOME, 70, 45), 10, false))),
    ],
    [
      'error: Part 1 of the fence is not right. A polygon has three corners at least.',
      planOf(good, fenced(polygon([HOME, north(9)], true))),
    ],
    [
      'error: Rally point 1 is not where the fence lets a drone be.',
      planOf(good, { ...fenced(circle(HOME, 150, true)), rally: [{ id: 1, frame: 3, spot: north(500), heightM: 30 }] }),
    ],
    [
      'error: Rally point 1 is not right. Height: 90000 m is outside of -500 to 10000 m.',
      planOf(good, { rally: [{ id: 1, frame: 3, spot: north(50), heightM: 90_000 }] }),
    ],
    ['error: The mission has 725 items; a drone takes 724 at most.', planOf(Array.from({ length: 725 }, () => back))],
    [
      'warning: The mission has 650 items; ArduPilot has room for 649 on the usual boards. An autopilot with less space refuses all of them.',
      planOf(Array.from({ length: 650 }, () => back)),
    ],
  ])('name the item and say: %s', (expected, plan, change) => expect(reported(plan, change)).toContain(expected));

  it('say that home is outside, that rounds do not end, and what they cannot check', () => {
    const far = circle(north(500), 30, true);
    expect(reported(planOf(good, fenced(far)))).toContain(
      'error: The planned home is not where the fence lets a drone be.',
    );
    const round = planOf([up, to(north(9)), jump(1, -1), back]);
    expect(reported(round)).toEqual([
      'warning: Item 3 (Jump) goes back to item 2 for ever: nothing after it is flown.',
      'warning: Item 4 (Return) is never reached.',
    ]);
    expect(reported(planOf(good, { home: null }))[0]).toContain('There is no planned home');
  });

  it('name the part, so that the page can show it', () => {
    const plan = planOf([up, to(north(1_500)), back]);
    expect(planChecks(plan, limits)).toMatchObject([{ part: plan.items[1]!.id, kind: 'mission' }]);
    expect(distanceM(HOME, north(1_500))).toBeCloseTo(1_500, 1);
  });
});

describe('the badge of the checks', () => {
  const finding = (severity: Finding['severity']): Finding => ({ severity, kind: 'mission', part: null, words: '' });
  const [error, warning] = [finding('error'), finding('warning')];

  it('counts errors, and warnings where there are none', () => {
    expect(checksBadge([]).badge).toBe(0);
    expect(checksBadge([warning])).toEqual({ badge: 1, tone: 'warning', counts: 'warning' });
    expect(checksBadge([warning, warning]).counts).toBe('warnings');
    expect(checksBadge([warning, error, error])).toEqual({ badge: 2, tone: 'danger', counts: 'errors' });
  });
});
