import { describe, expect, it } from 'vitest';

import { hitAt, planPlaces, planScene, type PlanScene } from '../../src/map/plan_scene';
import { Projection } from '../../src/map/projection';
import { CMD } from '../../src/plan/catalogue';
import { chooseTool, NOTHING_DRAWN, select, type Drawing } from '../../src/plan/drawing';
import { addRally, addShape, insertItems, newItem, setHome, setJumpTarget } from '../../src/plan/edits';
import { flownPath } from '../../src/plan/flown_path';
import { spotAt } from '../../src/plan/ground';
import { EMPTY_PLAN, spotOf, type Plan, type Spot } from '../../src/plan/plan_types';

const HOME = spotOf(47, 8);
const at = (north: number, east: number): Spot => spotAt(spotAt(HOME, north, 0), east, 90);
const item = (command: number, spot: Spot | null) => newItem(EMPTY_PLAN.defaults, command, spot);

/** Home, take-off in place, two waypoints, a circle and a square of the fence, a rally point. */
const PLAN: Plan = [
  setHome({ spot: HOME, altM: 400 }),
  insertItems(0, [item(CMD.TAKEOFF, null), item(CMD.WAYPOINT, at(0, 200)), item(CMD.WAYPOINT, at(200, 200))]),
  addShape({ shape: 'circle', inclusion: true, group: 0, frame: 0, centre: at(-300, 0), radiusM: 100 }),
  addShape({
    shape: 'polygon',
    inclusion: false,
    group: 0,
    frame: 0,
    corners: [at(-300, 300), at(-300, 500), at(-100, 500), at(-100, 300)],
  }),
  addRally({ frame: 3, spot: at(0, -200), heightM: 30 }),
].reduce((plan, edit) => edit.apply(plan), EMPTY_PLAN);
const [takeOff, first, second] = PLAN.items as [Plan['items'][0], Plan['items'][0], Plan['items'][0]];
const [circle, square] = PLAN.fence.shapes as [Plan['fence']['shapes'][0], Plan['fence']['shapes'][0]];

const sceneOf = (drawing: Drawing = NOTHING_DRAWN, plan = PLAN): PlanScene =>
  planScene({
    plan,
    path: flownPath(plan),
    drawing,
    preview: [],
    faults: new Set([second.id]),
    forbidden: new Set([2]),
    current: 1,
    reached: new Set([0]),
  });

const projection = new Projection({ centre: { latDeg: 47, lonDeg: 8 }, zoom: 17, widthPx: 1000, heightPx: 800 });
function hit(scene: PlanScene, spot: Spot, offPx = 0) {
  const { x, y } = projection.at({ latDeg: spot.latE7 / 1e7, lonDeg: spot.lonE7 / 1e7 });
  return hitAt(scene, { at: (place) => projection.at(place), x: x + offPx, y, reachPx: 14 });
}

describe('a plan on the map', () => {
  it("has its items with the table's numbers, and what is known of each", () => {
    const { items } = sceneOf();
    expect(
      items.map(({ label, sign, isReached, isCurrent, hasFault }) => [label, sign, isReached, isCurrent, hasFault]),
    ).toEqual([
      ['1', 'takeoff', true, false, false],
      ['2', 'way', false, true, false],
      ['3', 'way', false, false, true],
    ]);
    // Over home, which it would cover.
    expect(items[0]).toMatchObject({ place: { latDeg: 47, lonDeg: 8 } });
    expect(items[0]!.liftPx).toBeGreaterThan(0);
  });

  it('has each way once, however often it is flown, and no place to put an item into on the way back of a jump', () => {
    const jumping = insertItems(3, [item(CMD.JUMP, null)]).apply(PLAN);
    const round = setJumpTarget(jumping.items[3]!.id, first.id).apply(jumping);
    const { legs } = sceneOf(NOTHING_DRAWN, round);
    expect(legs.map((leg) => [leg.at, leg.isJump, leg.isForbidden])).toEqual([
      [1, false, false],
      [2, false, true],
      [null, true, false],
    ]);
  });

  it('is shown with all that it has, the whole of a circle too', () => {
    const lats = planPlaces(PLAN).map(({ latDeg }) => latDeg);
    expect(Math.min(...lats)).toBeCloseTo(at(-400, 0).latE7 / 1e7, 4);
    expect(planPlaces(EMPTY_PLAN)).toEqual([]);
  });
});

describe('under the pointer', () => {
  it('is the item, the rally point, home, or nothing', () => {
    expect(hit(sceneOf(), at(0, 200), 10)).toEqual({ on: 'item', id: first.id });
    expect(hit(sceneOf(), at(0, 200), 20)).toBeNull();
    expect(hit(sceneOf(), at(0, -200))).toEqual({ on: 'rally', id: PLAN.rally[0]!.id });
    expect(hit(sceneOf(), HOME)).toEqual({ on: 'home' });
    expect(hit(sceneOf(), at(11, 0))).toEqual({ on: 'item', id: takeOff.id });
  });

  it('is the middle of a way, where an item can be put in', () => {
    expect(hit(sceneOf(), at(100, 200))).toEqual({ on: 'leg', at: 2 });
    expect(hit(sceneOf(chooseTool(NOTHING_DRAWN, 'survey')), at(100, 200))).toBeNull();
  });

  it('is the outline of a shape, and its handles once it is chosen', () => {
    expect(hit(sceneOf(), at(-300, 100))).toEqual({ on: 'shape', id: circle.id });
    expect(hit(sceneOf(), at(-200, 400))).toBeNull();
    expect(hit(sceneOf(), at(-300, 330))).toEqual({ on: 'shape', id: square.id });
    const chosen = sceneOf(select(NOTHING_DRAWN, [circle.id, square.id]));
    expect(hit(chosen, at(-300, 100))).toEqual({ on: 'rim', id: circle.id });
    expect(hit(chosen, at(-300, 0))).toEqual({ on: 'centre', id: circle.id });
    expect(hit(chosen, at(-100, 500))).toEqual({ on: 'corner', of: square.id, at: 2 });
    expect(hit(chosen, at(-200, 300))).toEqual({ on: 'edge', of: square.id, at: 4 });
  });

  it('is what is being drawn, before all that lies below', () => {
    const draft = [at(0, 200), at(0, 400), at(200, 400)];
    const open = { ...chooseTool(NOTHING_DRAWN, 'survey'), draft };
    expect(hit(sceneOf(open), at(0, 200))).toEqual({ on: 'corner', of: 'draft', at: 0 });
    expect(hit(sceneOf(open), at(0, 300))).toEqual({ on: 'edge', of: 'draft', at: 1 });
    expect(hit(sceneOf(open), at(100, 300))).toBeNull();
    expect(hit(sceneOf({ ...open, isWhole: true }), at(100, 300))).toEqual({ on: 'edge', of: 'draft', at: 3 });
    const orbit = { ...chooseTool(NOTHING_DRAWN, 'orbit'), draft: [at(0, 200)], radiusM: 60 };
    expect(hit(sceneOf(orbit), at(0, 260))).toEqual({ on: 'draft-rim' });
    expect(hit(sceneOf(orbit), at(0, 200))).toEqual({ on: 'draft-centre' });
  });
});
