import { beforeEach, describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import {
  addItem,
  back,
  chooseTool,
  click,
  drag,
  finish,
  NOTHING_DRAWN,
  nudge,
  press,
  pruned,
  release,
  remove,
  select,
  settled,
  type Drawing,
  type Hit,
  type Step,
} from '../../src/plan/drawing';
import { setHeight } from '../../src/plan/edits';
import { distanceM, spotAt } from '../../src/plan/ground';
import { PlanEditor } from '../../src/plan/plan_editor';
import { spotOf, type Spot } from '../../src/plan/plan_types';

const HERE = spotOf(47, 8);
const at = (north: number, east: number): Spot => spotAt(spotAt(HERE, north, 0), east, 90);

let editor: PlanEditor;
let drawing: Drawing;

beforeEach(() => {
  editor = new PlanEditor();
  drawing = NOTHING_DRAWN;
});

function take(step: Step | null): void {
  expect(step).not.toBeNull();
  for (const edit of step!.edits) editor.apply(edit);
  drawing = step!.drawing;
}
const clickAt = (spot: Spot): void => take(click(drawing, editor.plan, spot));
const hold = (hit: Hit, from: Spot, ...way: readonly Spot[]): void => {
  take(press(drawing, editor.plan, hit, from));
  for (const spot of way) take(drag(drawing, editor.plan, spot));
  take(release(drawing, false));
};
const tool = (...words: [Parameters<typeof chooseTool>[1], number?]): void => {
  drawing = chooseTool(drawing, ...words);
};
const commands = (): number[] => editor.plan.items.map(({ command }) => command);
const places = (): Spot[] => editor.plan.items.map(({ x, y }) => ({ latE7: x, lonE7: y }));

/** Take-off and three waypoints. */
function drawn(): void {
  tool('item');
  for (const spot of [at(0, 50), at(0, 100), at(0, 150)]) clickAt(spot);
  tool('select');
  clickAt(HERE);
}

describe('waypoints', () => {
  it('come one with each click, after a take-off that the first brings along', () => {
    drawn();
    expect(commands()).toEqual([CMD.TAKEOFF, CMD.WAYPOINT, CMD.WAYPOINT, CMD.WAYPOINT]);
    expect(places().slice(1)).toEqual([at(0, 50), at(0, 100), at(0, 150)]);
    for (let step = 0; step < 3; step += 1) editor.undo();
    expect(editor.plan.items).toEqual([]);
  });

  it('follow what is selected, and each new one is', () => {
    drawn();
    drawing = select(drawing, [editor.plan.items[1]!.id]);
    tool('item');
    clickAt(at(10, 60));
    clickAt(at(10, 70));
    expect(places().slice(1)).toEqual([at(0, 50), at(10, 60), at(10, 70), at(0, 100), at(0, 150)]);
    expect([...drawing.selected]).toEqual([editor.plan.items[3]!.id]);
  });

  it('stand before the return that ends the mission', () => {
    drawn();
    take(addItem(select(drawing, []), editor.plan, CMD.RETURN, null));
    for (const selected of [[], [editor.plan.items.at(-1)!.id]]) {
      drawing = select(drawing, selected);
      tool('item');
      clickAt(at(0, 200));
      expect(commands().slice(-2)).toEqual([CMD.WAYPOINT, CMD.RETURN]);
    }
  });

  it('fly as high as the one before them', () => {
    drawn();
    editor.apply(setHeight(editor.plan.items[3]!.id, 80));
    tool('item');
    clickAt(at(0, 200));
    expect(editor.plan.items[4]!.z).toBe(80);
  });

  it('are put into the middle of a way and dragged on, as one step of undo', () => {
    drawn();
    hold({ on: 'leg', at: 2 }, at(0, 75), at(20, 75), at(40, 75));
    expect(places()[2]).toEqual(at(40, 75));
    expect(editor.plan.items).toHaveLength(5);
    editor.undo();
    expect(places().slice(1)).toEqual([at(0, 50), at(0, 100), at(0, 150)]);
  });

  it('are dragged alone, or all of those that are selected together', () => {
    drawn();
    const [, one, other, last] = editor.plan.items;
    hold({ on: 'item', id: one!.id }, at(0, 50), at(5, 55));
    expect(places()[1]).toEqual(at(5, 55));
    drawing = select(drawing, [one!.id, other!.id]);
    const before = places();
    hold({ on: 'item', id: one!.id }, HERE, { latE7: HERE.latE7 + 100, lonE7: HERE.lonE7 }, HERE, {
      latE7: HERE.latE7 + 300,
      lonE7: HERE.lonE7 - 50,
    });
    const moved = places();
    for (const seq of [1, 2]) {
      expect(moved[seq]).toEqual({ latE7: before[seq]!.latE7 + 300, lonE7: before[seq]!.lonE7 - 50 });
    }
    expect(editor.plan.items.find(({ id }) => id === last!.id)).toBe(last);
    editor.undo();
    expect(places()).toEqual(before);
  });

  it('are selected by a press without a drag, and more with a key', () => {
    drawn();
    const [, one, other] = editor.plan.items;
    hold({ on: 'item', id: one!.id }, HERE);
    expect([...drawing.selected]).toEqual([one!.id]);
    take(press(drawing, editor.plan, { on: 'item', id: other!.id }, HERE));
    take(release(drawing, true));
    expect([...drawing.selected]).toEqual([one!.id, other!.id]);
    clickAt(at(500, 500));
    expect(drawing.selected.size).toBe(0);
  });

  it('are removed, and the next one is selected: Delete again goes on', () => {
    drawn();
    const [, one, other] = editor.plan.items;
    drawing = select(drawing, [one!.id]);
    take(remove(drawing, editor.plan));
    expect([...drawing.selected]).toEqual([other!.id]);
    take(remove(drawing, editor.plan));
    expect(commands()).toEqual([CMD.TAKEOFF, CMD.WAYPOINT]);
  });

  it('go where the arrows say, in metres on the ground', () => {
    drawn();
    const one = editor.plan.items[1]!;
    drawing = select(drawing, [one.id]);
    const before = places()[1]!;
    for (let press = 0; press < 3; press += 1) take(nudge(drawing, 10, 10, editor.plan));
    expect(distanceM(before, places()[1]!)).toBeCloseTo(30 * Math.SQRT2, 0);
    editor.undo();
    expect(places()[1]).toEqual(before);
  });
});

describe('an outline', () => {
  const corners = [at(0, 0), at(0, 100), at(100, 100)];

  it('is whole after its first corner was pressed again, and never with two corners', () => {
    tool('survey');
    clickAt(corners[0]!);
    clickAt(corners[1]!);
    hold({ on: 'corner', of: 'draft', at: 0 }, corners[0]!);
    expect(drawing.isWhole).toBe(false);
    drawing = finish(drawing);
    expect(drawing.isWhole).toBe(false);
    clickAt(corners[2]!);
    hold({ on: 'corner', of: 'draft', at: 0 }, corners[0]!);
    expect(drawing.isWhole).toBe(true);
    expect(drawing.draft).toEqual(corners);
  });

  it('takes another corner in its side, gives one up, and falls open with two', () => {
    tool('survey');
    for (const spot of corners) clickAt(spot);
    drawing = finish(drawing);
    hold({ on: 'edge', of: 'draft', at: 3 }, at(50, 50), at(80, 20));
    expect(drawing.draft).toEqual([...corners, at(80, 20)]);
    take(remove(drawing, editor.plan));
    expect(drawing).toMatchObject({ draft: corners, isWhole: true });
    hold({ on: 'corner', of: 'draft', at: 1 }, corners[1]!);
    take(remove(drawing, editor.plan));
    expect(drawing).toMatchObject({ draft: [corners[0], corners[2]], isWhole: false });
    expect(editor.undoWords).toBeNull();
  });

  it('of the fence becomes a part of it, selected, and its corners can be dragged', () => {
    tool('fence-polygon');
    for (const spot of corners) clickAt(spot);
    take(settled(finish(drawing), editor.plan));
    const shape = editor.plan.fence.shapes[0]!;
    expect(shape).toMatchObject({ shape: 'polygon', inclusion: true, corners });
    expect(drawing.tool).toBe('select');
    expect([...drawing.selected]).toEqual([shape.id]);
    hold({ on: 'corner', of: shape.id, at: 2 }, corners[2]!, at(120, 120));
    hold({ on: 'edge', of: shape.id, at: 1 }, at(0, 50), at(-20, 50));
    expect(editor.plan.fence.shapes[0]).toMatchObject({ corners: [corners[0], at(-20, 50), corners[1], at(120, 120)] });
    editor.undo();
    expect(editor.plan.fence.shapes[0]).toMatchObject({ corners: [corners[0], corners[1], at(120, 120)] });
  });

  it('as a line has no first corner to close it by', () => {
    tool('corridor');
    clickAt(corners[0]!);
    clickAt(corners[1]!);
    hold({ on: 'corner', of: 'draft', at: 0 }, corners[0]!);
    expect(drawing.isWhole).toBe(false);
    expect(finish(drawing).isWhole).toBe(true);
  });
});

describe('circles, rally points and home', () => {
  it('a circle of the fence is moved by its middle and sized by its rim', () => {
    tool('fence-circle');
    clickAt(HERE);
    const { id } = editor.plan.fence.shapes[0]!;
    hold({ on: 'rim', id }, at(0, 100), at(0, 250));
    hold({ on: 'centre', id }, HERE, at(10, 0));
    expect(editor.plan.fence.shapes[0]).toMatchObject({ shape: 'circle', radiusM: 250, centre: at(10, 0) });
  });

  it('a circle that is to be flown keeps its size while it is moved', () => {
    tool('orbit');
    clickAt(HERE);
    hold({ on: 'draft-rim' }, at(0, 50), at(0, 80));
    hold({ on: 'draft-centre' }, HERE, at(30, 0));
    expect(drawing).toMatchObject({ radiusM: 80, draft: [at(30, 0)], isWhole: true });
  });

  it('rally points come one after another; home comes once, and keeps its height', () => {
    tool('rally');
    clickAt(at(0, 20));
    clickAt(at(0, 40));
    expect(editor.plan.rally.map(({ spot }) => spot)).toEqual([at(0, 20), at(0, 40)]);
    tool('home');
    clickAt(HERE);
    expect(drawing.tool).toBe('select');
    hold({ on: 'home' }, HERE, at(5, 0));
    expect(editor.plan.home).toEqual({ spot: at(5, 0), altM: 0 });
  });
});

describe('the map', () => {
  it('keeps presses that hit nothing, and those on what lies below while something is drawn', () => {
    drawn();
    const item: Hit = { on: 'item', id: editor.plan.items[1]!.id };
    expect(press(drawing, editor.plan, null, HERE)).toBeNull();
    tool('survey');
    expect(press(drawing, editor.plan, item, HERE)).toBeNull();
    tool('item');
    expect(press(drawing, editor.plan, item, HERE)).not.toBeNull();
  });
});

it('goes back one step with each Escape', () => {
  drawn();
  drawing = select(drawing, [editor.plan.items[1]!.id]);
  tool('survey');
  clickAt(HERE);
  drawing = back(drawing);
  expect(drawing).toMatchObject({ tool: 'survey', draft: [] });
  drawing = back(drawing);
  expect(drawing.tool).toBe('select');
  expect(drawing.selected.size).toBe(1);
  expect(back(drawing).selected.size).toBe(0);
});

it('does not hold on to what is gone', () => {
  drawn();
  drawing = select(
    drawing,
    editor.plan.items.map(({ id }) => id),
  );
  const kept = pruned(drawing, { ...editor.plan, items: editor.plan.items.slice(0, 1) });
  expect([...kept.selected]).toEqual([editor.plan.items[0]!.id]);
  expect(pruned(drawing, editor.plan)).toBe(drawing);
});
