/** Random plans for the property tests: everything that the wire can carry, even if it makes no sense to fly. */

import fc from 'fast-check';

import { CMD } from '../../src/plan/catalogue';
import type { Fence, FenceShape, Plan, RallyPoint, Spot, WireItem } from '../../src/plan/plan_types';
import { EMPTY_PLAN } from '../../src/plan/plan_types';
import { planItems, wireItem } from '../../src/plan/wire_items';

const number32 = fc.float({ noNaN: true, noDefaultInfinity: true });
const param = fc.option(number32, { nil: null });
const int32 = fc.integer({ min: -0x8000_0000, max: 0x7fff_ffff });

export const anyItem: fc.Arbitrary<WireItem> = fc
  .record({
    command: fc.integer({ min: 0, max: 0xffff }),
    frame: fc.integer({ min: 0, max: 0xff }),
    params: fc.tuple(param, param, param, param),
    x: int32,
    y: int32,
    z: number32,
    autocontinue: fc.integer({ min: 0, max: 1 }),
  })
  .map(({ command, frame, params, x, y, z, autocontinue }) => wireItem(command, frame, params, x, y, z, autocontinue));

export const spot: fc.Arbitrary<Spot> = fc.record({
  latE7: fc.integer({ min: -850_000_000, max: 850_000_000 }),
  lonE7: fc.integer({ min: -1_799_999_999, max: 1_799_999_999 }),
});

/** Heights and parameters as people type them, exactly float32. */
const metres = fc.integer({ min: -4_000, max: 40_000 }).map((quarters) => quarters / 4);
const globalFrame = fc.constantFrom(0, 3, 10);

const waypoint = fc
  .tuple(
    fc.constantFrom(CMD.WAYPOINT, CMD.LOITER_TIME, CMD.TAKEOFF, CMD.LAND, CMD.ROI_LOCATION),
    globalFrame,
    spot,
    metres,
  )
  .chain(([command, frame, at, z]) =>
    fc
      .tuple(metres, metres, metres, fc.option(metres, { nil: null }))
      .map((params) => wireItem(command, frame, params, at.latE7, at.lonE7, z)),
  );
const placeless = fc
  .tuple(fc.constantFrom(CMD.CHANGE_SPEED, CMD.CONDITION_YAW, CMD.TRIGGER_DISTANCE, CMD.RETURN), metres, metres)
  .map(([command, p1, p2]) => wireItem(command, 2, [p1, p2, 0, 0], 0, 0, 0));
const jump = fc
  .tuple(fc.nat({ max: 30 }), fc.integer({ min: -1, max: 5 }))
  .map(([to, times]) => wireItem(CMD.JUMP, 2, [to, times, 0, 0], 0, 0, 0));

export const missionOf = (longest: number): fc.Arbitrary<readonly WireItem[]> =>
  fc
    .array(
      fc.oneof({ weight: 6, arbitrary: waypoint }, { weight: 2, arbitrary: placeless }, { weight: 1, arbitrary: jump }),
      {
        maxLength: longest,
      },
    )
    .map((items) =>
      items.map((item) =>
        item.command === CMD.JUMP
          ? { ...item, params: [item.params[0]! % items.length, ...item.params.slice(1)] as never }
          : item,
      ),
    );

const shape = fc.oneof(
  fc
    .record({ inclusion: fc.boolean(), corners: fc.array(spot, { minLength: 3, maxLength: 8 }) })
    .map((one) => ({ shape: 'polygon' as const, group: 0, frame: 0, id: 0, ...one })),
  fc
    .record({ inclusion: fc.boolean(), centre: spot, radiusM: fc.integer({ min: 1, max: 4_000 }) })
    .map((one) => ({ shape: 'circle' as const, group: 0, frame: 0, id: 0, ...one })),
);

/** A plan of items that the planner knows, as people draw them. */
export const drawnPlan: fc.Arbitrary<Plan> = fc
  .record({
    items: missionOf(12),
    shapes: fc.array(shape, { maxLength: 4 }),
    rally: fc.array(fc.record({ spot, heightM: metres }), { maxLength: 4 }),
    home: fc.option(fc.record({ spot, altM: metres }), { nil: null }),
  })
  .map(({ items, shapes, rally, home }) => {
    const mission = planItems(items, 1);
    let nextId = mission.length + 1;
    const fence: Fence = { returnPoint: null, shapes: shapes.map((one): FenceShape => ({ ...one, id: nextId++ })) };
    const points = rally.map((one): RallyPoint => ({ ...one, frame: 3, id: nextId++ }));
    return { ...EMPTY_PLAN, home, items: mission, fence, rally: points, nextId };
  })
  .filter(({ items, fence, rally }) => items.length + fence.shapes.length + rally.length > 0);
