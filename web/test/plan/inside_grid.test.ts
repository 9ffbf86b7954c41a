/** Surveys of concave areas: what leaves the area is counted, and a survey on its inside leaves it nowhere. */

import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { specOf } from '../../src/plan/catalogue';
import { distanceM, spotAt } from '../../src/plan/ground';
import { cleanOutline, crossingsOf, inOrder } from '../../src/plan/outline';
import { spotOf, type Spot, type WireItem } from '../../src/plan/plan_types';
import { areaM2 } from '../../src/plan/survey/area';
import { insideItems, outsideOf } from '../../src/plan/survey/inside_grid';
import { patternPreview, USUAL_SETTINGS } from '../../src/plan/survey/patterns';
import { surveyItems } from '../../src/plan/survey/survey_grid';
import { examples } from '../examples';

const here = (east: number, north: number, from = spotOf(47.4, 8.5)): Spot =>
  spotAt(from, Math.hypot(east, north), (Math.atan2(east, north) * 180) / Math.PI);
const U = [
  [0, 0],
  [300, 0],
  [300, 300],
  [200, 300],
  [200, 100],
  [100, 100],
  [100, 300],
  [0, 300],
].map(([east, north]) => here(east!, north!));
const SETTINGS = { heightM: 50, frame: 3, triggerM: 10, spacingM: 20, angleDeg: 90, turnaroundM: 0, entry: 0 } as const;

const wayOf = (items: readonly WireItem[]): Spot[] =>
  items.filter(({ command }) => specOf(command)?.flies).map(({ x, y }) => ({ latE7: x, lonE7: y }));
const lengthOf = (way: readonly Spot[]): number =>
  way.slice(1).reduce((sum, spot, at) => sum + distanceM(way[at]!, spot), 0);
/** Metres flown with pictures. */
function photographedM(items: readonly WireItem[]): number {
  let [isOn, sum] = [false, 0];
  let last: Spot | null = null;
  for (const item of items) {
    if (item.command === 206) isOn = (item.params[0] ?? 0) > 0;
    if (!specOf(item.command)?.flies) continue;
    const spot = { latE7: item.x, lonE7: item.y };
    if (isOn && last) sum += distanceM(last, spot);
    last = spot;
  }
  return sum;
}

describe('a survey of a U', () => {
  it('leaves it by a third of its way, which is counted', () => {
    const way = wayOf(surveyItems(U, SETTINGS));
    const { lengthM } = outsideOf(U, way);
    expect(lengthM / lengthOf(way)).toBeGreaterThan(0.2);
    const settings = { ...USUAL_SETTINGS, camera: 'none', spacingM: 20, triggerM: 10, angleDeg: 90, turnaroundM: 0 };
    const preview = patternPreview('survey', U, 0, settings, 3, 'ardupilot');
    expect(preview.outsideM).toBeCloseTo(lengthM, 0);
    expect(patternPreview('survey', U, 0, { ...settings, staysInside: true }, 3, 'ardupilot').outsideM).toBe(0);
  });

  it.each([0, 30, 45, 90, 135])('stays inside at %i degrees, and takes the same pictures', (angleDeg) => {
    const usual = surveyItems(U, { ...SETTINGS, angleDeg });
    const inside = insideItems(U, { ...SETTINGS, angleDeg });
    expect(outsideOf(U, wayOf(inside)).lengthM).toBe(0);
    expect(photographedM(inside)).toBeCloseTo(photographedM(usual), 0);
  });

  it('begins at the chosen corner', () => {
    const firsts = ([0, 1, 2, 3] as const).map((entry) => wayOf(insideItems(U, { ...SETTINGS, entry }))[0]!);
    expect(new Set(firsts.map(({ latE7, lonE7 }) => `${latE7} ${lonE7}`)).size).toBe(4);
  });
});

it('a survey of a square is what it was', () => {
  const square = [here(0, 0), here(100, 0), here(100, 100), here(0, 100)];
  const way = wayOf(insideItems(square, SETTINGS));
  expect(way).toHaveLength(10);
  expect(outsideOf(square, way).lengthM).toBe(0);
  expect(outsideOf(square, wayOf(surveyItems(square, SETTINGS))).lengthM).toBe(0);
  const beyond = wayOf(surveyItems(square, { ...SETTINGS, turnaroundM: 10 }));
  expect(outsideOf(square, beyond).lengthM).toBeGreaterThan(5 * 20);
});

it('any area is surveyed on its inside, with the same pictures, across 180 degrees too', () => {
  const places = fc.uniqueArray(fc.tuple(fc.integer({ min: 0, max: 20 }), fc.integer({ min: 0, max: 20 })), {
    minLength: 4,
    maxLength: 14,
    selector: ([east, north]) => `${east},${north}`,
  });
  fc.assert(
    fc.property(places, fc.integer({ min: 0, max: 179 }), fc.boolean(), (all, angleDeg, isFar) => {
      const drawn = all.map(([east, north]) => here(20 * east - 200, 20 * north, isFar ? spotOf(-17, 180) : undefined));
      const area = cleanOutline(inOrder(drawn)).corners;
      fc.pre(area.length >= 3 && areaM2(area) > 500 && crossingsOf(area).length === 0);
      const settings = { ...SETTINGS, angleDeg };
      const items = insideItems(area, settings);
      expect(outsideOf(area, wayOf(items)).lengthM).toBe(0);
      expect(photographedM(items)).toBeCloseTo(photographedM(surveyItems(area, settings)), -1);
    }),
    { numRuns: examples(100, 400) },
  );
});
