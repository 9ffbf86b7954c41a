import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { settled, NOTHING_DRAWN, type Drawing } from '../../src/plan/drawing';
import { addShape, orderCorners } from '../../src/plan/edits';
import { shapeFaults } from '../../src/plan/field_checks';
import { cleanLine, cleanOutline, crossingsOf, inOrder, mayOrder } from '../../src/plan/outline';
import { distanceM, spotAt } from '../../src/plan/ground';
import { planChecks } from '../../src/plan/plan_checks';
import { EMPTY_PLAN, lonDegOf, spotOf, type FenceShape, type Spot } from '../../src/plan/plan_types';
import { areaM2 } from '../../src/plan/survey/area';
import { corridorLanes } from '../../src/plan/survey/corridor';
import { gridLines } from '../../src/plan/survey/survey_grid';
import { planScene } from '../../src/map/plan_scene';
import { flownPath } from '../../src/plan/flown_path';
import { bodyOf, crossesItself, newDraft, orderedPoints, pointsTooMany } from '../../src/zone_draft';
import { examples } from '../examples';

const METRE = 1 / 111_195;
/** Metres east and north of a place. */
const around =
  (lat: number, lon: number) =>
  (east: number, north: number): Spot =>
    spotAt(spotOf(lat, lon), Math.hypot(east, north), (Math.atan2(east, north) * 180) / Math.PI);
const here = around(47.4, 8.5);
const SQUARE = [here(0, 0), here(100, 0), here(100, 100), here(0, 100)];
const BOW = [here(0, 0), here(100, 100), here(100, 0), here(0, 100)];
const GRID = { heightM: 50, frame: 3, triggerM: null, spacingM: 20, angleDeg: 0, turnaroundM: 0, entry: 0 } as const;

describe('a clean outline', () => {
  it.each<[string, Spot[], number]>([
    ['as it is', SQUARE, 0],
    ['with a double click on its last corner', [...SQUARE, SQUARE[3]!], 1],
    ['with a double click on its first corner', [SQUARE[0]!, ...SQUARE], 1],
    ['that ends where it begins', [...SQUARE, SQUARE[0]!], 1],
    ['with a corner a hand beside another', [SQUARE[0]!, SQUARE[1]!, here(100, 0.05), SQUARE[2]!, SQUARE[3]!], 1],
    ['with every corner three times', SQUARE.flatMap((corner) => [corner, corner, corner]), 8],
    ['with a way out and back', [SQUARE[0]!, SQUARE[1]!, here(200, 0), SQUARE[1]!, SQUARE[2]!, SQUARE[3]!], 2],
    ['with a way along a side and back', [SQUARE[0]!, here(150, 0), SQUARE[1]!, SQUARE[2]!, SQUARE[3]!], 1],
  ])('%s', (_, drawn, doubled) => {
    const clean = cleanOutline(drawn);
    expect(clean.doubled).toBe(doubled);
    expect(clean.corners).toHaveLength(4);
    for (const corner of clean.corners)
      expect(Math.min(...SQUARE.map((one) => distanceM(one, corner)))).toBeLessThan(0.1);
    expect(crossingsOf(clean.corners)).toEqual([]);
    expect(areaM2(clean.corners)).toBeCloseTo(areaM2(SQUARE), -1);
  });

  it('keeps a corner that somebody put on a side', () => {
    const drawn = [SQUARE[0]!, here(50, 0), ...SQUARE.slice(1)];
    expect(cleanOutline(drawn)).toEqual({ corners: drawn, doubled: 0 });
  });

  it('of places that are one or a line has too few corners', () => {
    for (const drawn of [[], [SQUARE[0]!], Array<Spot>(5).fill(SQUARE[0]!), [here(0, 0), here(50, 0), here(100, 0)]]) {
      expect(cleanOutline(drawn).corners.length).toBeLessThan(3);
    }
  });

  it('of any outline keeps its area', () => {
    const spots = fc.array(fc.tuple(fc.integer({ min: -300, max: 300 }), fc.integer({ min: -300, max: 300 })), {
      minLength: 3,
      maxLength: 12,
    });
    const twice = (corners: readonly Spot[]): number =>
      corners.reduce((sum, one, at) => {
        const next = corners[(at + 1) % corners.length]!;
        return (
          sum +
          (one.lonE7 - corners[0]!.lonE7) * (next.latE7 - corners[0]!.latE7) -
          (next.lonE7 - corners[0]!.lonE7) * (one.latE7 - corners[0]!.latE7)
        );
      }, 0);
    fc.assert(
      fc.property(spots, fc.nat({ max: 20 }), (places, again) => {
        const drawn = places.map(([east, north]) => here(east, north));
        const doubled = drawn.toSpliced(again % drawn.length, 0, drawn[again % drawn.length]!);
        const squareMetre = 80 ** 2 * 1.5; // in (1e-7 degrees)²
        const error = Math.abs(twice(cleanOutline(doubled).corners) - twice(drawn)) / squareMetre;
        if (cleanOutline(doubled).corners.length >= 3) expect(error).toBeLessThan(300);
      }),
      { numRuns: examples(100, 1000) },
    );
  });
});

describe('an outline that crosses itself', () => {
  it('has the place', () => {
    const [crossing, ...more] = crossingsOf(BOW);
    expect(more).toEqual([]);
    expect(crossing?.edges).toEqual([0, 2]);
    expect(distanceM(crossing!.spot, here(50, 50))).toBeLessThan(0.1);
  });

  it('does not cross where it only touches itself', () => {
    const touching = [here(0, 0), here(100, 0), here(50, 50), here(100, 100), here(0, 100), here(50, 50)];
    expect(crossingsOf(touching)).toEqual([]);
  });

  it('is put in order, with the same corners', () => {
    const places = fc.uniqueArray(fc.tuple(fc.integer({ min: 0, max: 400 }), fc.integer({ min: 0, max: 400 })), {
      minLength: 4,
      maxLength: 30,
      selector: ([east, north]) => `${east},${north}`,
    });
    fc.assert(
      fc.property(places, (all) => {
        const drawn = all.map(([east, north]) => here(3 * east, 3 * north));
        const ordered = inOrder(drawn);
        expect(crossingsOf(ordered)).toEqual([]);
        expect(new Set(ordered)).toEqual(new Set(cleanOutline(drawn).corners));
      }),
      { numRuns: examples(100, 1000) },
    );
  });

  it('of very many corners is not put in order, and found all the same', () => {
    const tangle = Array.from({ length: 700 }, (_, at) => here((at * 7919) % 1000, (at * 104_729) % 1000));
    const clean = cleanOutline(tangle).corners;
    expect(crossingsOf(clean)).toHaveLength(20);
    expect(mayOrder(tangle)).toBe(false);
  });
});

describe('across the 180th meridian', () => {
  const there = around(-17, 180);
  const square = [there(-100, -100), there(100, -100), there(100, 100), there(-100, 100)];

  it('an outline is cleaned, crossed and put in order', () => {
    expect(square.map((spot) => Math.sign(lonDegOf(spot)))).toEqual([1, -1, -1, 1]);
    expect(cleanOutline([...square, square[0]!])).toEqual({ corners: square, doubled: 1 });
    const bow = [square[0]!, square[2]!, square[1]!, square[3]!];
    const [crossing] = crossingsOf(bow);
    expect(distanceM(crossing!.spot, there(0, 0))).toBeLessThan(0.5);
    expect(crossingsOf(inOrder(bow))).toEqual([]);
    expect(areaM2(square)).toBeCloseTo(40_000, -3);
  });

  it('an area is surveyed as anywhere else', () => {
    const lines = gridLines(square, { ...GRID, angleDeg: 90 });
    const same = gridLines([here(-100, -100), here(100, -100), here(100, 100), here(-100, 100)], {
      ...GRID,
      angleDeg: 90,
    });
    expect(lines.length).toBe(same.length);
    for (const { from, to } of lines) expect(distanceM(from, to)).toBeCloseTo(200, -1);
  });

  it('a corridor is flown as anywhere else', () => {
    const settings = { heightM: 50, frame: 3, triggerM: null, widthM: 40, spacingM: 20, fromEnd: false };
    for (const lane of corridorLanes([there(-300, 0), there(300, 0)], settings)) {
      expect(distanceM(lane[0]!, lane.at(-1)!)).toBeCloseTo(600, -1);
    }
  });
});

const fenceOf = (corners: readonly Spot[]): FenceShape => ({
  shape: 'polygon',
  id: 7,
  inclusion: true,
  group: 0,
  frame: 0,
  corners,
});

describe('the same everywhere', () => {
  it('a doubled corner of a survey is no fault', () => {
    expect(gridLines([...SQUARE, SQUARE[3]!], GRID)).toEqual(gridLines(SQUARE, GRID));
    expect(() => gridLines(BOW, GRID)).toThrow('crosses itself');
  });

  it('a doubled place of a corridor counts once', () => {
    expect(cleanLine([SQUARE[0]!, SQUARE[1]!, here(100, 0.05), SQUARE[0]!])).toEqual({
      corners: [SQUARE[0], SQUARE[1], SQUARE[0]],
      doubled: 1,
    });
  });

  it('a fence is drawn without its doubled corner', () => {
    const drawing: Drawing = { ...NOTHING_DRAWN, tool: 'fence-polygon', draft: [...SQUARE, SQUARE[3]!], isWhole: true };
    const [edit] = settled(drawing, EMPTY_PLAN).edits;
    expect(edit!.apply(EMPTY_PLAN).fence.shapes).toMatchObject([{ corners: SQUARE }]);
  });

  it('a fence that crosses itself is a finding, marked on the map, and put in order by one edit', () => {
    expect(shapeFaults(fenceOf([...SQUARE, SQUARE[3]!]))).toEqual([]);
    expect(shapeFaults(fenceOf(BOW))).toEqual([
      'Its border crosses itself: inside and outside are not what they seem.',
    ]);
    const plan = addShape(fenceOf(BOW)).apply(EMPTY_PLAN);
    const path = flownPath(plan);
    const limits = { autopilot: 'ardupilot', highestM: 120, farthestM: null } as const;
    expect(planChecks(plan, limits, path)).toMatchObject([{ severity: 'error', kind: 'fence', part: 1 }]);
    const shown = {
      drawing: NOTHING_DRAWN,
      path,
      preview: [],
      faults: new Set<number>(),
      forbidden: new Set<number>(),
      current: null,
      reached: new Set<number>(),
    };
    expect(planScene({ ...shown, plan }).crossings).toHaveLength(1);
    const mended = orderCorners(1).apply(plan);
    expect(planChecks(mended, limits, path)).toEqual([]);
    expect(planScene({ ...shown, plan: mended }).crossings).toEqual([]);
    const drawing: Drawing = { ...NOTHING_DRAWN, tool: 'survey', draft: BOW, isWhole: true };
    expect(planScene({ ...shown, drawing, plan: mended }).crossings).toHaveLength(1);
  });

  it('a zone is sent without doubled corners, and put in order before it is refused', () => {
    const at = (north: number, east: number): readonly [number, number] => [47 + north * METRE, 8 + east * METRE];
    const points = [at(0, 0), at(0, 100), at(100, 100), at(100, 100), at(100, 0)];
    expect(pointsTooMany(newDraft({ points }))).toBe(1);
    expect(bodyOf(newDraft({ points })).points).toEqual([points[0], points[1], points[2], points[4]]);
    const bow = newDraft({ points: [at(0, 0), at(100, 100), at(0, 100), at(100, 0)] });
    expect(crossesItself(bow)).toBe(true);
    expect(crossesItself({ ...bow, isLine: true })).toBe(false);
    const ordered = orderedPoints(bow)!;
    expect(crossesItself({ ...bow, points: ordered })).toBe(false);
    const line = newDraft({ isLine: true, points: [at(0, 0), at(0, 0), at(0, 50), at(0, 100)] });
    expect(bodyOf(line).points).toHaveLength(3);
  });
});
