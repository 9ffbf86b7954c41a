import fc from 'fast-check';
import { expect, it } from 'vitest';

import { partOfItem } from '../../src/plan/part_of_item';
import { itemsOf } from '../../src/plan/wire_items';
import { drawnPlan } from './plan_arbitraries';

it('each item that is sent belongs to the part whose place it has, and to none past the last', () => {
  fc.assert(
    fc.property(drawnPlan, (plan) => {
      expect(itemsOf(plan, 'mission').map((_, at) => partOfItem(plan, 'mission', at))).toEqual(
        plan.items.map(({ id }) => id),
      );
      expect(itemsOf(plan, 'rally').map((_, at) => partOfItem(plan, 'rally', at))).toEqual(
        plan.rally.map(({ id }) => id),
      );
      const fence = itemsOf(plan, 'fence');
      for (const [at, { x, y }] of fence.entries()) {
        const shape = plan.fence.shapes.find(({ id }) => id === partOfItem(plan, 'fence', at));
        const spots = shape
          ? shape.shape === 'polygon'
            ? shape.corners
            : [shape.centre]
          : [plan.fence.returnPoint?.spot];
        expect(spots).toContainEqual({ latE7: x, lonE7: y });
      }
      for (const kind of ['mission', 'fence', 'rally'] as const)
        expect(partOfItem(plan, kind, itemsOf(plan, kind).length)).toBeNull();
    }),
  );
});
