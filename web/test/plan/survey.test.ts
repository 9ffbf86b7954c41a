import { booleanPointInPolygon } from '@turf/boolean-point-in-polygon';
import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { bearingDeg, distanceM, spotAt, turnDeg } from '../../src/plan/ground';
import { latDegOf, lonDegOf, spotOf, type Spot } from '../../src/plan/plan_types';
import { areaM2, SurveyFault } from '../../src/plan/survey/area';
import { splitArea } from '../../src/plan/survey/area_split';
import { distancesFor, footprint } from '../../src/plan/survey/camera';
import { corridorItems, corridorLanes, orbitItems } from '../../src/plan/survey/corridor';
import { gridLines, lineItems, surveyItems, type GridSettings } from '../../src/plan/survey/survey_grid';
import { examples } from '../examples';

const GRID: GridSettings = {
  spacingM: 20,
  angleDeg: 0,
  turnaroundM: 0,
  entry: 0,
  heightM: 40,
  frame: 3,
  triggerM: null,
};

/** A corner this many metres east and north of a place. */
function off(from: Spot, east: number, north: number): Spot {
  const angle = (Math.atan2(east, north) * 180) / Math.PI;
  return spotAt(from, Math.hypot(east, north), angle);
}

const square = (middle: Spot, side: number): Spot[] => [
  off(middle, -side / 2, -side / 2),
  off(middle, -side / 2, side / 2),
  off(middle, side / 2, side / 2),
  off(middle, side / 2, -side / 2),
];

const middles = [spotOf(0.5, 8), spotOf(47.4, 8.5), spotOf(60, 25), spotOf(-60, -70), spotOf(80, 15)];

interface Outline {
  readonly area: Spot[];
  /** The same, a metre or more larger on every side: plane and sphere differ by centimetres. */
  readonly grown: Spot[];
}

/** Outlines with bays and capes, anywhere except at the poles and the 180th meridian. */
const outline: fc.Arbitrary<Outline> = fc
  .tuple(
    fc.integer({ min: -80, max: 80 }),
    fc.integer({ min: -178, max: 178 }),
    fc.array(fc.integer({ min: 100, max: 400 }), { minLength: 4, maxLength: 9 }),
  )
  .map(([lat, lon, radii]) => {
    const scaled = (factor: number): Spot[] =>
      radii.map((radius, at) => spotAt(spotOf(lat, lon), radius * factor, (360 * at) / radii.length));
    return { area: scaled(1), grown: scaled(1.02) };
  });

const isIn = (spot: Spot, area: readonly Spot[]): boolean => {
  const ring = [...area, area[0]!].map((corner) => [lonDegOf(corner), latDegOf(corner)]);
  return booleanPointInPolygon([lonDegOf(spot), latDegOf(spot)], { type: 'Polygon', coordinates: [ring] });
};

describe('a grid', () => {
  it.each(middles)('over a square has lines of its length, as far apart as asked: %j', (middle) => {
    const lines = gridLines(square(middle, 200), GRID);
    expect(lines).toHaveLength(10);
    for (const [at, line] of lines.entries()) {
      expect(distanceM(line.from, line.to)).toBeCloseTo(200, 0);
      expect(turnDeg(bearingDeg(line.from, line.to), at % 2 ? 180 : 0)).toBeLessThan(0.1);
      const next = lines[at + 1];
      if (next) expect(distanceM(line.to, next.from)).toBeCloseTo(20, 1);
    }
  });

  it('covers any area, and takes pictures nowhere else', () => {
    fc.assert(
      fc.property(outline, fc.integer({ min: 0, max: 359 }), ({ area, grown }, angleDeg) => {
        const lines = gridLines(area, { ...GRID, spacingM: 4, angleDeg });
        const pieces = lines.flatMap((line) => line.pieces);
        const covered = pieces.reduce((sum, [from, to]) => sum + distanceM(from, to), 0) * 4;
        expect(Math.abs(covered / areaM2(area) - 1)).toBeLessThan(0.03);
        for (const [from, to] of pieces) {
          if (distanceM(from, to) < 1) continue;
          for (const part of [0.01, 0.5, 0.99]) {
            const along = spotAt(from, distanceM(from, to) * part, bearingDeg(from, to));
            expect(isIn(along, grown)).toBe(true);
          }
        }
      }),
      { numRuns: examples(20, 120) },
    );
  });

  it('stops its pictures over the bay of a concave area', () => {
    const middle = spotOf(60, 25);
    const bay = [
      off(middle, -100, -100),
      off(middle, 100, -100),
      off(middle, 100, -50),
      off(middle, -50, -50),
      off(middle, -50, 50),
      off(middle, 100, 50),
      off(middle, 100, 100),
      off(middle, -100, 100),
    ];
    const lines = gridLines(bay, { ...GRID, spacingM: 50 });
    expect(lines.map((line) => line.pieces.length)).toEqual([1, 2, 2, 2]);
    const items = lineItems(lines.slice(1, 2), { ...GRID, triggerM: 10 });
    expect(items.map((item) => [item.command, item.command === CMD.TRIGGER_DISTANCE ? item.params[0] : null])).toEqual([
      [16, null],
      [206, 10],
      [16, null],
      [206, 0],
      [16, null],
      [206, 10],
      [16, null],
      [206, 0],
    ]);
  });

  it('begins at any of its four corners', () => {
    const area = square(spotOf(47, 8), 200);
    const starts = ([0, 1, 2, 3] as const).map((entry) => gridLines(area, { ...GRID, entry })[0]!.from);
    const corner = starts.map(
      (start) => `${start.latE7 > 470_000_000 ? 'n' : 's'}${start.lonE7 > 80_000_000 ? 'e' : 'w'}`,
    );
    expect(corner).toEqual(['sw', 'nw', 'se', 'ne']);
  });

  it('turns outside of the area, as far as asked, without pictures', () => {
    const area = square(spotOf(47, 8), 100);
    const [first, second] = gridLines(area, { ...GRID, turnaroundM: 15 });
    for (const line of [first!, second!]) {
      expect(distanceM(line.from, line.pieces[0]![0])).toBeCloseTo(15, 1);
      expect(distanceM(line.pieces[0]![1], line.to)).toBeCloseTo(15, 1);
      expect(distanceM(line.from, line.to)).toBeCloseTo(130, 0);
    }
    const items = surveyItems(area, { ...GRID, turnaroundM: 15, triggerM: 10 });
    expect(items.slice(0, 6).map((item) => item.command)).toEqual([16, 16, 206, 16, 206, 16]);
    expect(items[0]).toMatchObject({ z: 40, frame: 3, params: [0, 0, 0, null] });
    expect(items).toHaveLength(5 * 6);
  });

  it('has a line through an area that is narrower than the spacing', () => {
    expect(gridLines(square(spotOf(47, 8), 10), { ...GRID, spacingM: 50 })).toHaveLength(1);
  });

  const good = square(spotOf(47, 8), 100);
  it.each<[string, readonly Spot[], Partial<GridSettings>]>([
    ['three corners', good.slice(0, 2), {}],
    ['half the earth', [spotOf(0, -100), spotOf(1, 0), spotOf(0, 100)], {}],
    ['too near a pole', square(spotOf(89, 0), 100), {}],
    ['crosses itself', [good[0]!, good[2]!, good[1]!, good[3]!], {}],
    ['smaller than a square metre', square(spotOf(47, 8), 0.5), {}],
    ['distance between lines', good, { spacingM: 0 }],
    ['distance between lines', good, { spacingM: NaN }],
    ['2000 are the most', good, { spacingM: 0.01 }],
    ['turnaround distance', good, { turnaroundM: -1 }],
    ['distance between photos', good, { triggerM: 0 }],
  ])('that cannot be is refused in words: %s', (words, area, change) => {
    expect(() => surveyItems(area, { ...GRID, ...change })).toThrow(SurveyFault);
    expect(() => surveyItems(area, { ...GRID, ...change })).toThrow(words);
  });
});

describe('a camera', () => {
  const camera = {
    sensorWidthMm: 13.2,
    sensorHeightMm: 8.8,
    focalMm: 8.8,
    widthPx: 5472,
    heightPx: 3648,
    isAcross: true,
  };

  it('sees so much of the ground, and asks for lines and pictures so far apart', () => {
    const seen = footprint(camera, 100);
    expect(seen.acrossM).toBeCloseTo(150, 9);
    expect(seen.alongM).toBeCloseTo(100, 9);
    expect(seen.pixelCm).toBeCloseTo(2.741, 3);
    const { spacingM, triggerM } = distancesFor(seen, 75, 65);
    expect(spacingM).toBeCloseTo(52.5, 9);
    expect(triggerM).toBeCloseTo(25, 9);
    expect(footprint({ ...camera, isAcross: false }, 100).acrossM).toBeCloseTo(100, 9);
  });

  it('that cannot be is refused in words', () => {
    expect(() => footprint({ ...camera, focalMm: 0 }, 100)).toThrow('focal length');
    expect(() => footprint(camera, 0)).toThrow('height above the ground');
    expect(() => distancesFor(footprint(camera, 100), 100, 60)).toThrow('100 %');
  });
});

describe('an area for several drones', () => {
  it('is split into equal parts that are the whole together', () => {
    fc.assert(
      fc.property(
        outline,
        fc.integer({ min: 1, max: 7 }),
        fc.integer({ min: 0, max: 359 }),
        ({ area }, parts, angleDeg) => {
          const whole = areaM2(area);
          const split = splitArea(area, parts, angleDeg);
          expect(split).toHaveLength(parts);
          const sum = split.reduce((all, part) => all + areaM2(part), 0);
          expect(Math.abs(sum / whole - 1)).toBeLessThan(0.005);
          for (const part of split) expect(Math.abs(areaM2(part) / (whole / parts) - 1)).toBeLessThan(0.015);
        },
      ),
      { numRuns: examples(20, 120) },
    );
  });

  it('runs along the lines, so that each part has its own', () => {
    const [west, east] = splitArea(square(spotOf(47, 8), 200), 2, 0);
    expect(Math.max(...west!.map((spot) => spot.lonE7))).toBeCloseTo(80_000_000, -2);
    expect(Math.min(...east!.map((spot) => spot.lonE7))).toBeCloseTo(80_000_000, -2);
    expect(gridLines(west!, GRID)).toHaveLength(5);
  });

  it('is refused in words where that makes no sense', () => {
    expect(() => splitArea(square(spotOf(47, 8), 200), 0, 0)).toThrow('1 to 50');
    expect(() => splitArea(square(spotOf(47, 8), 200), 2.5, 0)).toThrow(SurveyFault);
  });
});

describe('a corridor', () => {
  const settings = { widthM: 30, spacingM: 10, fromEnd: false, heightM: 40, frame: 3, triggerM: 12 };

  it.each(middles)('has lanes beside its line, to and fro: %j', (start) => {
    const line = [start, off(start, 0, 300)];
    const lanes = corridorLanes(line, settings);
    expect(lanes).toHaveLength(3);
    for (const [at, [from, to]] of lanes.entries()) {
      expect(turnDeg(bearingDeg(from!, to!), at === 1 ? 180 : 0)).toBeLessThan(0.1);
    }
    expect(distanceM(lanes[0]![0]!, start)).toBeCloseTo(10, 1);
    expect(distanceM(lanes[1]![1]!, start)).toBeLessThan(0.1);
    expect(lanes[0]![0]!.lonE7).toBeLessThan(lanes[2]![0]!.lonE7);
  });

  it('keeps its distance from both sides of a bend', () => {
    const start = spotOf(60, 25);
    const bend = off(start, 0, 300);
    const lanes = corridorLanes([start, bend, off(bend, 300, 0)], settings);
    expect(distanceM(lanes[0]![1]!, bend)).toBeCloseTo(10 * Math.SQRT2, 1);
    expect(distanceM(lanes[2]![1]!, bend)).toBeCloseTo(10 * Math.SQRT2, 1);
    expect(distanceM(lanes[0]![1]!, lanes[2]![1]!)).toBeCloseTo(20 * Math.SQRT2, 1);
  });

  it('does not run far out where its line turns straight back', () => {
    const start = spotOf(47, 8);
    const lanes = corridorLanes([start, off(start, 0, 300), off(start, 1, 0)], settings);
    for (const spot of lanes.flat()) expect(distanceM(spot, start)).toBeLessThan(340);
  });

  it('is flown with pictures along each lane, from either end', () => {
    const line = [spotOf(47, 8), spotOf(47.001, 8), spotOf(47.002, 8.001)];
    const items = corridorItems(line, settings);
    expect(items.map((item) => item.command)).toEqual(Array.from({ length: 3 }, () => [16, 206, 16, 16, 206]).flat());
    expect(corridorItems(line, { ...settings, fromEnd: true })[0]!.x).toBeGreaterThan(items[0]!.x);
  });

  it('that cannot be is refused in words', () => {
    const line = [spotOf(47, 8), spotOf(47.1, 8)];
    expect(() => corridorLanes([line[0]!, line[0]!], settings)).toThrow('two different places');
    expect(() => corridorLanes(line, { ...settings, spacingM: 0 })).toThrow('above 0');
    expect(() => corridorLanes(line, { ...settings, widthM: 1e6 })).toThrow('2000 are the most');
    expect(() => corridorItems(line, { ...settings, triggerM: -1 })).toThrow('distance between photos');
  });
});

describe('an orbit', () => {
  const settings = {
    radiusM: 50,
    heightM: 30,
    frame: 3,
    turns: 2,
    points: 8,
    isClockwise: true,
    fromDeg: 90,
    lookAtM: 5,
    looksByLegacyRoi: false,
  };

  it.each(middles)('keeps its radius, its sense, and its eye on the middle: %j', (centre) => {
    const items = orbitItems(centre, settings);
    expect(items[0]).toMatchObject({ command: CMD.ROI_LOCATION, x: centre.latE7, y: centre.lonE7, z: 5 });
    expect(items.at(-1)!.command).toBe(CMD.ROI_NONE);
    const ring = items.slice(1, -1).map(({ x, y }) => ({ latE7: x, lonE7: y }));
    expect(ring).toHaveLength(17);
    for (const [at, spot] of ring.entries()) {
      expect(distanceM(centre, spot)).toBeCloseTo(50, 1);
      expect(turnDeg(bearingDeg(centre, spot), 90 + at * 45)).toBeLessThan(0.1);
    }
    const legacy = orbitItems(centre, { ...settings, looksByLegacyRoi: true });
    expect(legacy[0]).toMatchObject({ command: CMD.ROI, frame: 3, x: centre.latE7, y: centre.lonE7, z: 5 });
    expect(legacy.at(-1)).toMatchObject({ command: CMD.ROI, frame: 3, params: [0, 0, 0, 0], x: 0, y: 0, z: 0 });
    expect(legacy.slice(1, -1)).toEqual(items.slice(1, -1));
    const other = orbitItems(centre, { ...settings, isClockwise: false, lookAtM: null });
    expect(turnDeg(bearingDeg(centre, { latE7: other[1]!.x, lonE7: other[1]!.y }), 45)).toBeLessThan(0.1);
  });

  it('that cannot be is refused in words', () => {
    expect(() => orbitItems(spotOf(47, 8), { ...settings, radiusM: 0 })).toThrow('radius');
    expect(() => orbitItems(spotOf(47, 8), { ...settings, points: 2 })).toThrow('3 to 72');
    expect(() => orbitItems(spotOf(47, 8), { ...settings, turns: 0.5 })).toThrow('1 to 50');
    expect(orbitItems(spotOf(0, 180), settings)).toHaveLength(orbitItems(spotOf(0, 8), settings).length);
  });
});
