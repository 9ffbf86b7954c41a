import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { documentOf, planOfDocument } from '../../src/plan/plan_document';
import { planHash } from '../../src/plan/plan_hash';
import { EMPTY_PLAN, spotOf, type PlanKind } from '../../src/plan/plan_types';
import { fenceOfItems, itemsOf, rallyOfItems, wireItem, withItems } from '../../src/plan/wire_items';
import { anyItem, drawnPlan } from './plan_arbitraries';
import { examples } from '../examples';

const KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];
const corner = (command: number, count: number, lat: number) => wireItem(command, 0, [count, 0, 0, 0], lat, 5, 0);

describe("a plan and the wire's items", () => {
  it('any mission comes back byte for byte', () => {
    fc.assert(
      fc.property(fc.array(anyItem, { maxLength: 30 }), (items) => {
        expect(itemsOf(withItems(EMPTY_PLAN, 'mission', items).plan, 'mission')).toEqual(items);
      }),
      { numRuns: examples(166, 1000) },
    );
  });

  it('what was drawn comes back from the items and from the document, with the same hashes', () => {
    fc.assert(
      fc.property(drawnPlan, (plan) => {
        const { plan: read, dropped } = planOfDocument(JSON.parse(JSON.stringify(documentOf(plan))));
        expect(dropped).toEqual([]);
        expect(read.home).toEqual(plan.home);
        for (const kind of KINDS) {
          expect(itemsOf(read, kind)).toEqual(itemsOf(plan, kind));
          expect(planHash(kind, itemsOf(read, kind))).toBe(planHash(kind, itemsOf(plan, kind)));
        }
      }),
    );
  });

  it('gives every part of a plan an id of its own', () => {
    fc.assert(
      fc.property(drawnPlan, (plan) => {
        const { plan: read } = planOfDocument(documentOf(plan));
        const ids = [...read.items, ...read.fence.shapes, ...read.rally].map((part) => part.id);
        expect(new Set(ids).size).toBe(ids.length);
        expect(Math.max(0, ...ids)).toBeLessThan(read.nextId);
      }),
    );
  });
});

describe('a fence from a drone', () => {
  it('has its polygons, circles and return point', () => {
    const items = [
      wireItem(CMD.FENCE_RETURN, 0, [0, 0, 0, 0], 1, 2, 30),
      ...[1, 2, 3].map((lat) => corner(CMD.FENCE_POLYGON_IN, 3, lat)),
      ...[4, 5, 6, 7].map((lat) => corner(CMD.FENCE_POLYGON_IN, 4, lat)),
      wireItem(CMD.FENCE_CIRCLE_OUT, 0, [25, 0, 0, 0], 8, 9, 0),
    ];
    const { fence, dropped } = fenceOfItems(items, 1);
    expect(dropped).toEqual([]);
    expect(fence.returnPoint).toEqual({ frame: 0, spot: { latE7: 1, lonE7: 2 }, heightM: 30 });
    expect(fence.shapes.map((one) => (one.shape === 'polygon' ? one.corners.length : one.radiusM))).toEqual([3, 4, 25]);
    expect(itemsOf({ ...EMPTY_PLAN, fence }, 'fence')).toEqual(items);
  });

  it('says what of it makes no sense, and takes the rest', () => {
    const items = [
      corner(CMD.FENCE_POLYGON_OUT, 3, 1),
      corner(CMD.FENCE_POLYGON_OUT, 3, 2),
      wireItem(CMD.FENCE_CIRCLE_IN, 0, [25, 0, 0, 0], 8, 9, 0),
      wireItem(CMD.WAYPOINT, 3, [0, 0, 0, 0], 1, 1, 1),
    ];
    const { fence, dropped } = fenceOfItems(items, 1);
    expect(fence.shapes).toHaveLength(1);
    expect(dropped).toEqual([
      'Fence item 1: a corner of a polygon that is not whole.',
      'Fence item 2: a corner of a polygon that is not whole.',
      'Fence item 4: command 16 is none of a fence.',
    ]);
  });

  it('may have no rally points that are none', () => {
    const { rally, dropped } = rallyOfItems([wireItem(16, 3, [0, 0, 0, 0], 1, 1, 1)], 1);
    expect(rally).toEqual([]);
    expect(dropped).toEqual(['Rally item 1: command 16 is no rally point.']);
  });
});

describe('a document that is no plan', () => {
  const good = documentOf({ ...EMPTY_PLAN, home: { spot: spotOf(47, 8), altM: 500 } });
  it.each<[unknown, string]>([
    [null, 'not a plan'],
    [[], 'not a plan'],
    [{ ...good, fence: undefined }, 'its fence is not a list'],
    [{ ...good, mission: [[16, 3]] }, 'Item 1 of the mission is not a list of seven fields'],
    [{ ...good, mission: Array.from({ length: 725 }, () => []) }, '724 are the most'],
    [{ ...good, home: { lat_e7: 1e10, lon_e7: 0, alt_m: 0 } }, 'home'],
    [{ ...good, defaults: { height_m: 'high', frame: 3, speed_m_s: 5 } }, 'defaults'],
  ])('is refused in words: %j', (document, words) => {
    expect(() => planOfDocument(document)).toThrow(RangeError);
    expect(() => planOfDocument(document)).toThrow(words);
  });
});
