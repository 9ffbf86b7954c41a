import fc from 'fast-check';
import { beforeEach, describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import * as edits from '../../src/plan/edits';
import { MAX_STEPS, PlanEditor } from '../../src/plan/plan_editor';
import { EMPTY_PLAN, spotOf, type PartId } from '../../src/plan/plan_types';
import { missionItems } from '../../src/plan/wire_items';
import { drawnPlan } from './plan_arbitraries';

const HERE = spotOf(47.39, 8.54);
const { defaults } = EMPTY_PLAN;
const waypoint = (northE7 = 0) =>
  edits.newItem(defaults, CMD.WAYPOINT, { latE7: HERE.latE7 + northE7, lonE7: HERE.lonE7 });

let changes: number;
let editor: PlanEditor;

beforeEach(() => {
  changes = 0;
  editor = new PlanEditor(EMPTY_PLAN, () => (changes += 1));
});

const ids = (): PartId[] => editor.plan.items.map((item) => item.id);

/** Waypoints 1 to 5 and, as item 6, a jump back to the second, three times. */
function withJump(): PartId[] {
  editor.apply(
    edits.insertItems(
      0,
      [0, 1, 2, 3, 4].map((at) => waypoint(at * 1_000)),
    ),
  );
  const jump = edits.newItem(defaults, CMD.JUMP, null);
  editor.apply(edits.insertItems(5, [{ ...jump, params: [0, 3, 0, 0], jumpTo: ids()[1]! }]));
  return ids();
}

const jumpsTo = (): number | null | undefined =>
  missionItems(editor.plan).find((item) => item.command === CMD.JUMP)?.params[0];

describe('items', () => {
  it('begin with the defaults of the plan and of their command', () => {
    expect(waypoint()).toEqual({
      command: 16,
      frame: 3,
      params: [0, 0, 0, null],
      x: 473_900_000,
      y: 85_400_000,
      z: 50,
      autocontinue: 1,
    });
    expect(edits.newItem(defaults, CMD.CHANGE_SPEED, HERE)).toMatchObject({
      frame: 2,
      params: [1, 5, -1, 0],
      x: 0,
      z: 0,
    });
    expect(edits.newItem(defaults, CMD.LAND, HERE)).toMatchObject({ x: 473_900_000, z: 0 });
  });

  it('are put in, dragged, changed and taken out', () => {
    editor.apply(edits.insertItems(0, [waypoint(), waypoint(10)]));
    const [first, second] = ids();
    editor.apply(edits.insertItems(1, [edits.newItem(defaults, CMD.RETURN, null)]));
    expect(editor.plan.items.map((item) => item.command)).toEqual([16, 20, 16]);
    editor.apply(edits.placeItem(first!, spotOf(10, 20)));
    editor.apply(edits.setHeight(first!, 12.3));
    editor.apply(edits.setFrame(first!, 10));
    editor.apply(edits.setParam(first!, 0, 7));
    expect(editor.plan.items[0]).toMatchObject({
      x: 1e8,
      y: 2e8,
      z: Math.fround(12.3),
      frame: 10,
      params: [7, 0, 0, null],
    });
    editor.apply(edits.removeItems([second!]));
    expect(editor.plan.items.map((item) => item.command)).toEqual([16, 20]);
  });

  it('become another command at the same place and height, with its own parameters', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    editor.apply(edits.setHeight(ids()[0]!, 33));
    editor.apply(edits.setCommand(ids()[0]!, CMD.LOITER_TIME));
    expect(editor.plan.items[0]).toMatchObject({ command: 19, params: [10, 0, 0, 0], x: HERE.latE7, z: 33 });
  });
});

describe('a jump', () => {
  it('follows its item wherever that is moved', () => {
    const all = withJump();
    expect(jumpsTo()).toBe(1);
    editor.apply(edits.moveItems([all[1]!], all[4]!));
    expect(ids()).toEqual([all[0], all[2], all[3], all[1], all[4], all[5]]);
    expect(jumpsTo()).toBe(3);
    editor.apply(edits.insertItems(0, [waypoint()]));
    expect(jumpsTo()).toBe(4);
  });

  it('goes to what followed its item when that is taken out, and nowhere when nothing did', () => {
    const all = withJump();
    editor.apply(edits.removeItems([all[1]!, all[2]!]));
    expect(editor.plan.items.find((item) => item.command === CMD.JUMP)?.jumpTo).toBe(all[3]);
    editor.apply(edits.removeItems([all[3]!, all[4]!]));
    expect(jumpsTo()).toBe(edits.NOWHERE);
    editor.apply(edits.setJumpTarget(all[5]!, all[0]!));
    expect(jumpsTo()).toBe(0);
  });

  it('is never made out of what is no jump, nor sent to what is not there', () => {
    const all = withJump();
    expect(editor.apply(edits.setJumpTarget(all[0]!, all[1]!))).toBe(false);
    expect(editor.apply(edits.setJumpTarget(all[5]!, 999))).toBe(false);
  });
});

describe('the list', () => {
  it('moves several together, in their order, to the end too', () => {
    const all = withJump();
    editor.apply(edits.moveItems([all[3]!, all[0]!], null));
    expect(ids()).toEqual([all[1], all[2], all[4], all[5], all[0], all[3]]);
    expect(editor.apply(edits.moveItems([all[3]!], all[3]!))).toBe(false);
    expect(editor.apply(edits.moveItems([all[3]!], null))).toBe(false);
    expect(editor.apply(edits.removeItems([999]))).toBe(false);
  });
});

describe('the fence and the rally points', () => {
  it('are drawn, bent and taken away', () => {
    const corners = [spotOf(1, 1), spotOf(1, 2), spotOf(2, 2)];
    editor.apply(edits.addShape({ shape: 'polygon', inclusion: true, group: 0, frame: 0, corners }));
    editor.apply(edits.addShape({ shape: 'circle', inclusion: false, group: 0, frame: 0, centre: HERE, radiusM: 30 }));
    const [polygon, circle] = editor.plan.fence.shapes.map((shape) => shape.id);
    expect(editor.apply(edits.removeCorner(polygon!, 0))).toBe(false);
    editor.apply(edits.insertCorner(polygon!, 3, spotOf(2, 1)));
    editor.apply(edits.placeCorner(polygon!, 0, spotOf(0.5, 1)));
    editor.apply(edits.setInclusion(polygon!, false));
    editor.apply(edits.setRadius(circle!, 40.1));
    editor.apply(edits.placeCircle(circle!, spotOf(3, 3)));
    expect(editor.plan.fence.shapes).toMatchObject([
      { inclusion: false, corners: [spotOf(0.5, 1), spotOf(1, 2), spotOf(2, 2), spotOf(2, 1)] },
      { centre: spotOf(3, 3), radiusM: Math.fround(40.1) },
    ]);
    editor.apply(edits.removeCorner(polygon!, 1));
    editor.apply(edits.removeShape(circle!));
    expect(editor.plan.fence.shapes).toMatchObject([{ corners: [spotOf(0.5, 1), spotOf(2, 2), spotOf(2, 1)] }]);
    editor.apply(edits.addRally({ frame: 3, spot: HERE, heightM: 30 }));
    const rally = editor.plan.rally[0]!.id;
    editor.apply(edits.changeRally(rally, { heightM: 40 }));
    expect(editor.plan.rally).toEqual([{ id: rally, frame: 3, spot: HERE, heightM: 40 }]);
    editor.apply(edits.removeRally(rally));
    expect(editor.plan.rally).toEqual([]);
  });
});

describe('undo and redo', () => {
  it('go back and forth, and say what they do', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    editor.apply(edits.setHeight(ids()[0]!, 80));
    expect(editor.undoWords).toBe('Change a height');
    expect(editor.undo()).toBe(true);
    expect(editor.plan.items[0]!.z).toBe(50);
    expect(editor.redoWords).toBe('Change a height');
    expect(editor.redo()).toBe(true);
    expect(editor.plan.items[0]!.z).toBe(80);
    expect(editor.redo()).toBe(false);
    expect(changes).toBe(4);
  });

  it('take a drag for one step', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    const [id] = ids();
    for (let step = 1; step <= 30; step += 1) editor.apply(edits.placeItem(id!, spotOf(47, 8 + step / 100), 'drag 1'));
    editor.apply(edits.placeItem(id!, spotOf(46, 8), 'drag 2'));
    editor.undo();
    expect(editor.plan.items[0]).toMatchObject({ x: 470_000_000, y: 83_000_000 });
    editor.undo();
    expect(editor.plan.items[0]).toMatchObject({ x: HERE.latE7, y: HERE.lonE7 });
  });

  it('begin a new step when the same gesture goes on after an undo', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    const [id] = ids();
    editor.apply(edits.setHeight(id!, 60, 'typing'));
    editor.undo();
    editor.apply(edits.setHeight(id!, 70, 'typing'));
    editor.undo();
    expect(editor.plan.items[0]!.z).toBe(50);
  });

  it('remember a bounded number of steps', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    for (let step = 0; step < MAX_STEPS + 50; step += 1) editor.apply(edits.setHeight(ids()[0]!, step));
    let undone = 0;
    while (editor.undo()) undone += 1;
    expect(undone).toBe(MAX_STEPS);
    expect(editor.plan.items[0]!.z).toBe(49);
  });

  it('never give the id of something undone to something new', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    const [dead] = ids();
    editor.undo();
    editor.apply(edits.insertItems(0, [waypoint()]));
    expect(ids()[0]).not.toBe(dead);
    expect(editor.redo()).toBe(false);
  });

  it('know what is saved, an undo back to it too', () => {
    editor.apply(edits.insertItems(0, [waypoint()]));
    expect(editor.hasUnsaved).toBe(true);
    editor.markSaved();
    editor.apply(edits.insertItems(0, [waypoint()]));
    expect(editor.hasUnsaved).toBe(true);
    editor.undo();
    expect(editor.hasUnsaved).toBe(false);
  });

  it('lead back to just what was there, whatever was done', () => {
    const places = fc.array(fc.tuple(fc.nat({ max: 5 }), fc.nat(), fc.nat()), { minLength: 1, maxLength: 25 });
    fc.assert(
      fc.property(drawnPlan, places, (plan, actions) => {
        const one = new PlanEditor(plan);
        const seen = [plan];
        for (const [action, a, b] of actions) {
          const { items } = one.plan;
          const pick = (n: number): PartId => items[n % Math.max(1, items.length)]?.id ?? -1;
          const edit = [
            edits.insertItems(a % (items.length + 1), [waypoint(b % 1000)]),
            edits.removeItems([pick(a), pick(b)]),
            edits.moveItems([pick(a)], pick(b)),
            edits.setParam(pick(a), 1, b % 100),
            edits.setCommand(pick(a), b % 2 ? CMD.RETURN : CMD.WAYPOINT),
            edits.setJumpTarget(pick(a), pick(b)),
          ][action]!;
          const targets = new Map(one.plan.items.map((item) => [item.id, item.jumpTo]));
          if (!one.apply(edit)) continue;
          seen.push(one.plan);
          const here = new Set(one.plan.items.map((item) => item.id));
          expect(here.size).toBe(one.plan.items.length);
          for (const item of one.plan.items) {
            if (item.jumpTo !== null) expect(here).toContain(item.jumpTo);
            if (action === 2 || action === 0) expect(item.jumpTo).toBe(targets.get(item.id) ?? null);
          }
        }
        for (const before of seen.slice(0, -1).reverse()) {
          one.undo();
          expect(missionItems(one.plan)).toEqual(missionItems(before));
        }
        for (const after of seen.slice(1)) {
          one.redo();
          expect(missionItems(one.plan)).toEqual(missionItems(after));
        }
      }),
    );
  });
});
