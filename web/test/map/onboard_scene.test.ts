import { expect, it } from 'vitest';

import type { Row } from '../../src/link/mission_rest';
import { onboardScene, laidOut, type OnboardHome } from '../../src/map/onboard_scene';
import { CMD } from '../../src/plan/catalogue';

const HOME: OnboardHome = { place: { latDeg: 47, lonDeg: 8 }, altM: 400 };
const row = (command: number, x: number, y: number, params: Row[2] = [0, 0, 0, 0]): Row => [
  command,
  3,
  params,
  x,
  y,
  20,
  1,
];
const MISSION = [
  row(CMD.TAKEOFF, 0, 0),
  row(CMD.WAYPOINT, 470010000, 80000000),
  row(CMD.WAYPOINT, 470010000, 80020000),
];
const FENCE = [row(CMD.FENCE_CIRCLE_IN, 470000000, 80000000, [300, 0, 0, 0])];
const RALLY = [row(CMD.RALLY, 469990000, 80000000)];

it('has the items with their numbers, what was reached and what comes, the ways between them, fence and rally points', () => {
  const laid = laidOut({ mission: MISSION, fence: FENCE, rally: RALLY }, HOME);
  const scene = onboardScene(laid, 1, new Set([0]));
  expect(scene.items.map(({ label, isCurrent, isReached }) => [label, isCurrent, isReached])).toEqual([
    ['1', false, true],
    ['2', true, false],
    ['3', false, false],
  ]);
  expect(scene.legs.map(({ from, to }) => [from, to])).toEqual([
    [HOME.place, { latDeg: 47.001, lonDeg: 8 }],
    [
      { latDeg: 47.001, lonDeg: 8 },
      { latDeg: 47.001, lonDeg: 8.002 },
    ],
  ]);
  expect(scene.shapes).toMatchObject([{ isIn: true, radiusM: 300, isSelected: false }]);
  expect(scene.rally).toMatchObject([{ label: 'R1' }]);
});

it('has nothing to take hold of, and leaves home to the layer of the drones', () => {
  const scene = onboardScene(laidOut({ mission: MISSION }, HOME), null, new Set());
  expect([scene.home, scene.showsHandles, scene.draft, scene.corner]).toEqual([null, false, null, null]);
  expect(scene.items.some(({ isSelected, isCurrent }) => isSelected || isCurrent)).toBe(false);
});

it('draws what has a place while home is not known', () => {
  const scene = onboardScene(laidOut({ mission: MISSION }, null), null, new Set());
  expect(scene.items.map(({ label }) => label)).toEqual(['2', '3']);
  expect(scene.legs).toHaveLength(1);
});

it('refuses items that are none', () => {
  const spoilt = [...MISSION, [16, 3]] as unknown as Row[];
  expect(() => laidOut({ mission: spoilt }, HOME)).toThrow('Item 4 of the mission is not a list of seven fields.');
});
