/**
 * The survey that `tests/unit/simulator/test_survey_over_hills.py` flies over the simulator's hills, and
 * `tests/real` over the same with a real ArduCopter: made here by the planner, kept as a file.
 */

import { expect, it } from 'vitest';

import { FRAME } from '../../src/plan/frames';
import { latDegOf, lonDegOf, spotOf, type Spot } from '../../src/plan/plan_types';
import { patternPreview, USUAL_SETTINGS } from '../../src/plan/survey/patterns';
import { rowOf } from '../../src/plan/wire_items';

const HOME = { latDeg: 47.397742, lonDeg: 8.545594 };
const METRES_PER_DEGREE = 111_318.84502145034;
const LON_SCALE = Math.cos((HOME.latDeg * Math.PI) / 180);

/** `simulator/terrain.py` once more: metres above home. */
function hillsM(northM: number, eastM: number): number {
  const waves: readonly [number, number, number, number][] = [
    [34, 1 / 1900, 1 / 1300, 0.4],
    [17, 1 / 700, -1 / 1100, 1.9],
    [8, -1 / 430, 1 / 520, 3.1],
  ];
  const height = waves.reduce(
    (sum, [high, east, north, phase]) => sum + high * Math.sin(2 * Math.PI * (east * eastM + north * northM) + phase),
    14,
  );
  const away = (eastM ** 2 + northM ** 2) / 300 ** 2;
  return height * (1 - Math.exp(-away * away));
}

const ground = (spot: Spot): number =>
  488 +
  hillsM(
    (latDegOf(spot) - HOME.latDeg) * METRES_PER_DEGREE,
    (lonDegOf(spot) - HOME.lonDeg) * METRES_PER_DEGREE * LON_SCALE,
  );
const off = (northM: number, eastM: number): Spot =>
  spotOf(HOME.latDeg + northM / METRES_PER_DEGREE, HOME.lonDeg + eastM / (METRES_PER_DEGREE * LON_SCALE));

it('a survey of two hundred items over the hills is the one that is flown', async () => {
  const area = [off(150, 120), off(150, 620), off(640, 620), off(640, 120)];
  const settings = { ...USUAL_SETTINGS, overGround: true, toleranceM: 1, camera: 'none', spacingM: 19, turnaroundM: 0 };
  const land = { home: spotOf(HOME.latDeg, HOME.lonDeg), ground };
  const { items, fault } = patternPreview('survey', area, 0, settings, FRAME.GLOBAL_RELATIVE_ALT, 'ardupilot', land);
  expect(fault).toBe('');
  expect(items.length).toBeGreaterThanOrEqual(200);
  const rows = `[\n${items.map((item) => JSON.stringify(rowOf(item))).join(',\n')}\n]\n`;
  await expect(rows).toMatchFileSnapshot('./files/hills_survey.json');
});
