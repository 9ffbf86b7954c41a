/**
 * Files as QGroundControl and Mission Planner write them, made from their documented formats: supported content is read
 * and written completely, the rest is reported.
 */

import { readFileSync } from 'node:fs';

import { describe, expect, it } from 'vitest';

import { openPlanFile } from '../../src/plan/formats/open_plan_file';
import type { ReadFile } from '../../src/plan/formats/plan_file';
import { writeQgcPlan } from '../../src/plan/formats/qgc_plan';
import { writeWaypoints } from '../../src/plan/formats/waypoint_file';
import type { Plan, PlanKind } from '../../src/plan/plan_types';
import { itemsOf, rowOf } from '../../src/plan/wire_items';

const DEFAULTS = { heightM: 60, frame: 3, speedMS: 4 };
const noXml = (): Document => {
  throw new Error('no file here is XML');
};
const open = (text: string): ReadFile => openPlanFile(text, { defaults: DEFAULTS }, noXml);
const sample = (name: string): string => readFileSync(new URL(`files/${name}`, import.meta.url), 'utf8');
const rows = (plan: Plan, kind: PlanKind): unknown[] => itemsOf(plan, kind).map(rowOf);
const all = (plan: Plan): unknown[] => [rows(plan, 'mission'), rows(plan, 'fence'), rows(plan, 'rally'), plan.home];

/** Every value of the file, 1 for each item: command, frame, parameters, x, y, z, autocontinue. */
const CORRIDOR = [
  [22, 3, [15, 0, 0, null], 473_977_000, 85_456_000, 25, 1],
  [178, 2, [1, 7.5, -1, 0], 0, 0, 0, 1],
  [205, 2, [-90, 0, 0, 0], 0, 0, 2, 1],
  [16, 10, [0, 0, 0, null], 473_982_220, 85_441_110, 50, 1],
  [16, 10, [0, 0, 0, null], 473_993_331, 85_452_221, 50, 1],
  [16, 0, [12.5, 0.5, 0, 182.5], -338_688_197, 1_512_092_955, 541.5, 0],
  [18, 3, [2.5, 0, -40, null], 473_984_000, 85_461_000, 30, 1],
  [195, 3, [0, 0, 0, 0], 473_986_000, 85_463_000, 5, 1],
  [2000, 2, [0, 0, 1, null], 0, 0, 0, 1],
  // "doJumpId" 5 is the first of the corridor: item 3, counted from 0.
  [177, 2, [3, -1, 0, 0], 0, 0, 0, 1],
  [31_337, 2, [1, 2, 3, 4], 5, 6, 7, 1],
];
const FENCE = [
  [5000, 3, [0, 0, 0, 0], 473_979_000, 85_447_000, 45, 1],
  [5001, 0, [4, 0, 0, 0], 473_950_000, 85_410_000, 0, 1],
  [5001, 0, [4, 0, 0, 0], 474_010_000, 85_410_000, 0, 1],
  [5001, 0, [4, 0, 0, 0], 474_010_000, 85_490_000, 0, 1],
  [5001, 0, [4, 0, 0, 0], 473_950_000, 85_490_000, 0, 1],
  [5002, 0, [3, 0, 0, 0], 473_985_000, 85_441_000, 0, 1],
  [5002, 0, [3, 0, 0, 0], 473_989_000, 85_441_000, 0, 1],
  [5002, 0, [3, 0, 0, 0], 473_989_000, 85_449_000, 0, 1],
  [5004, 0, [95.25, 0, 0, 0], 473_978_000, 85_452_000, 0, 1],
];
const RALLY = [
  [5100, 3, [0, 0, 0, 0], 473_979_000, 85_459_000, 50, 1],
  [5100, 3, [0, 0, 0, 0], 473_969_000, 85_449_000, 62.5, 1],
];

describe('a plan of QGroundControl with a corridor, for a PX4', () => {
  const { plan, dropped } = open(sample('corridor_px4.plan'));

  it('comes in with every value that it has', () => {
    expect(rows(plan, 'mission')).toEqual(CORRIDOR);
    expect(rows(plan, 'fence')).toEqual(FENCE);
    expect(rows(plan, 'rally')).toEqual(RALLY);
    expect(plan.home).toEqual({ spot: { latE7: 473_977_000, lonE7: 85_456_000 }, altM: 488 });
    expect(plan.defaults.speedMS).toBe(5);
  });

  it('says what was not taken', () => {
    expect(dropped).toEqual([
      'Item 4, a corridor: its 2 items were taken, its outline and its settings for camera and spacing were not.',
      'Item 10, a landing pattern of a plane, is left out: the file does not say which waypoints it stands for.',
    ]);
  });

  it('goes out and comes back without a loss', () => {
    const written = writeQgcPlan(plan, 'px4');
    expect(written.dropped).toEqual([]);
    const head = JSON.parse(written.text).mission;
    expect([head.firmwareType, head.vehicleType, head.hoverSpeed]).toEqual([12, 2, 5]);
    const again = open(written.text);
    expect(again.dropped).toEqual([]);
    expect(all(again.plan)).toEqual(all(plan));
  });

  it('goes out as waypoint files, one kind each, and comes back without a loss', () => {
    for (const kind of ['mission', 'fence', 'rally'] as const) {
      const again = open(writeWaypoints(plan, kind).text);
      expect(again.dropped).toEqual([]);
      expect(rows(again.plan, kind)).toEqual(rows(plan, kind));
    }
  });
});

describe('a plan of an old QGroundControl', () => {
  it('has its border as one to stay inside of, and says so', () => {
    const { plan, dropped } = open(sample('old_fence.plan'));
    expect(rows(plan, 'mission')).toEqual([[16, 3, [0, 0, 0, 0], -349_285_000, 1_385_812_000, 50, 1]]);
    expect(rows(plan, 'rally')).toEqual([[5100, 3, [0, 0, 0, 0], -349_300_000, 1_385_800_000, 50, 1]]);
    expect(rows(plan, 'fence')).toEqual([
      [5000, 3, [0, 0, 0, 0], -349_285_000, 1_385_812_000, 0, 1],
      [5001, 0, [4, 0, 0, 0], -348_800_000, 1_384_900_000, 0, 1],
      [5001, 0, [4, 0, 0, 0], -348_700_000, 1_386_400_000, 0, 1],
      [5001, 0, [4, 0, 0, 0], -350_400_000, 1_386_900_000, 0, 1],
      [5001, 0, [4, 0, 0, 0], -350_000_000, 1_385_000_000, 0, 1],
    ]);
    expect(dropped).toEqual(['The fence is of version 1: its border was taken as one to stay inside of.']);
  });
});

describe('files of Mission Planner', () => {
  it('with a mission come in with every value, their jumps counted without home', () => {
    const { plan, dropped } = open(sample('tour.waypoints'));
    expect(dropped).toEqual([]);
    expect(plan.home).toEqual({ spot: { latE7: 473_977_420, lonE7: 85_455_939 }, altM: 488 });
    expect(rows(plan, 'mission')).toEqual([
      [22, 3, [0, 0, 0, 0], 0, 0, 20, 1],
      [82, 3, [2, 0, 0, 0], 473_979_111, 85_459_222, 25.5, 1],
      [19, 3, [30, 0, 1, 0], 473_981_333, 85_461_444, 25.5, 1],
      [18, 3, [3, 0, -25, 0], 473_983_555, 85_463_666, 30, 1],
      [201, 3, [0, 0, 0, 0], 473_984_000, 85_464_000, 0, 1],
      [178, 3, [1, 4.5, 0, 0], 0, 0, 0, 1],
      [206, 3, [12.5, 0, 0, 0], 0, 0, 0, 1],
      [115, 3, [270, 20, -1, 0], 0, 0, 0, 1],
      [205, 3, [-45, 0, 90, 0], 0, 0, 2, 1],
      [16, 10, [0, 0, 0, 0], 473_985_777, 85_465_888, 35, 1],
      [177, 3, [1, 3, 0, 0], 0, 0, 0, 1],
      [183, 3, [9, 1500, 0, 0], 0, 0, 0, 1],
      [211, 3, [1, 0, 0, 0], 0, 0, 0, 1],
      [21, 3, [0, 0, 0, 0], 473_977_000, 85_456_000, 0, 1],
    ]);
  });

  it('with a fence and with rally points come in as what they are', () => {
    const fence = open(sample('fence.waypoints'));
    expect(fence.dropped).toEqual([]);
    expect(fence.plan.items).toEqual([]);
    expect(fence.plan.fence.shapes.map(({ shape, inclusion }) => [shape, inclusion])).toEqual([
      ['polygon', true],
      ['polygon', false],
      ['circle', true],
      ['circle', false],
    ]);
    expect(rows(fence.plan, 'fence')).toHaveLength(9);
    const rally = open(sample('rally.waypoints'));
    expect(rally.dropped).toEqual([]);
    expect(rows(rally.plan, 'rally')).toEqual(RALLY);
  });

  it.each([
    ['tour.waypoints', 'mission'],
    ['fence.waypoints', 'fence'],
    ['rally.waypoints', 'rally'],
    ['mission.waypoints', 'mission'],
  ] as const)('go out and come back without a loss: %s', (name, kind) => {
    const { plan } = open(sample(name));
    const written = writeWaypoints(plan, kind);
    expect(written.dropped).toEqual([]);
    const again = open(written.text);
    expect(again.dropped).toEqual([]);
    expect(all(again.plan)).toEqual(all(plan));
    const lines = (text: string): string[][] =>
      text
        .trim()
        .split(/\r?\n/)
        .map((line) => line.split('\t'));
    const numbers = (text: string): unknown => lines(text).map((line) => line.map((one) => Number(one)));
    expect(numbers(written.text)).toEqual(numbers(sample(name)));
  });
});
