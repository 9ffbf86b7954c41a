/** The layer between the plan and its page: plan on board, survey settings, saved work, item texts, dragged rows. */

import { describe, expect, it } from 'vitest';

import { CMD } from '../../src/plan/catalogue';
import { addRally, insertItems, newItem, setJumpTarget } from '../../src/plan/edits';
import { savePlan } from '../../src/plan/formats/save_plan';
import { spotAt } from '../../src/plan/ground';
import { itemWords } from '../../src/plan/item_words';
import { kindStates, overwritten, toSend, type OnboardPlan } from '../../src/plan/on_board';
import { planHash } from '../../src/plan/plan_hash';
import { keepPlan, keptPlan } from '../../src/plan/plan_keeping';
import { EMPTY_PLAN, spotOf, type Plan } from '../../src/plan/plan_types';
import { anchorFor, anchorForStep, rowBefore } from '../../src/plan/row_drag';
import { CAMERAS, longestSideDeg, patternPreview, USUAL_SETTINGS } from '../../src/plan/survey/patterns';
import { itemsOf } from '../../src/plan/wire_items';

const HERE = spotOf(47, 8);
const FIELD = [HERE, spotAt(HERE, 200, 90), spotAt(spotAt(HERE, 200, 90), 100, 0), spotAt(HERE, 100, 0)];
const add = (plan: Plan, ...commands: readonly number[]): Plan =>
  insertItems(
    plan.items.length,
    commands.map((command) => newItem(plan.defaults, command, HERE)),
  ).apply(plan);
const PLAN = addRally({ frame: 3, spot: HERE, heightM: 30 }).apply(
  add(EMPTY_PLAN, CMD.TAKEOFF, CMD.WAYPOINT, CMD.RETURN),
);
const reported = (
  plan: Plan,
  kind: 'mission' | 'fence' | 'rally',
  changes: Partial<OnboardPlan> = {},
): OnboardPlan => ({
  hash: planHash(kind, itemsOf(plan, kind)),
  sent_hash: null,
  count: itemsOf(plan, kind).length,
  fit_to_fly: true,
  ...changes,
});

describe('what is on board', () => {
  it('is the plan on the screen, another one, or unknown, of each kind', () => {
    const states = kindStates(PLAN, { mission: reported(PLAN, 'mission'), rally: reported(EMPTY_PLAN, 'rally') });
    expect(states.map(({ kind, standing, here, there }) => [kind, standing, here, there])).toEqual([
      ['mission', 'on the drone', 3, 3],
      ['fence', 'unknown', 0, null],
      ['rally', 'changed', 1, 0],
    ]);
  });

  it('is the plan on the screen too where the autopilot kept it in its own way', () => {
    const { hash } = reported(PLAN, 'mission');
    const other = reported(PLAN, 'mission', { hash: 'ffffffffffffffff', sent_hash: hash });
    expect(kindStates(PLAN, { mission: other })[0]!.standing).toBe('on the drone');
    expect(kindStates(PLAN, { mission: { ...other, sent_hash: null } })[0]!.standing).toBe('changed');
    expect(kindStates(PLAN, { mission: { ...other, hash: null } })[0]!.standing).toBe('unknown');
  });

  it('that may be half a plan says so', () => {
    expect(kindStates(PLAN, { mission: reported(PLAN, 'mission', { fit_to_fly: false }) })[0]!.isFit).toBe(false);
  });

  it('is left alone where the screen has none of it, and asked about where something would be overwritten', () => {
    const fence = { hash: 'ffffffffffffffff', sent_hash: null, count: 5, fit_to_fly: true };
    const states = kindStates(PLAN, {
      mission: reported(EMPTY_PLAN, 'mission'),
      fence,
      rally: reported(PLAN, 'rally'),
    });
    expect(toSend(states)).toEqual(['mission']);
    expect(overwritten(states, ['mission'])).toEqual([]);
    expect(overwritten(states, ['mission', 'fence']).map(({ kind }) => kind)).toEqual(['fence']);
    const unknown = kindStates(PLAN, {});
    expect(toSend(unknown)).toEqual(['mission', 'rally']);
    expect(overwritten(unknown, ['mission'])).toHaveLength(1);
  });
});

describe('a survey as it is set', () => {
  const typed = { ...USUAL_SETTINGS, camera: 'none', spacingM: 20, triggerM: 0, turnaroundM: 0, angleDeg: 90 };

  it('has the lines that its distances make', () => {
    const preview = patternPreview('survey', FIELD, 0, typed, 3, 'ardupilot');
    expect(preview.fault).toBe('');
    expect(preview.items.filter(({ command }) => command === CMD.WAYPOINT)).toHaveLength(10);
    expect(preview.areaM2).toBeCloseTo(20_000, -3);
    expect(preview.lengthM).toBeCloseTo(5 * 200 + 4 * 20, -1);
    expect(preview).toMatchObject({ pictures: 0, triggerM: null, pixelCm: null });
  });

  it("has the distances that a camera's overlaps make, and its pictures", () => {
    const preview = patternPreview(
      'survey',
      FIELD,
      0,
      { ...USUAL_SETTINGS, heightM: 32, turnaroundM: 0, angleDeg: 90 },
      3,
      'ardupilot',
    );
    // 23.5 mm over 16 mm at 32 m: 47 m across, 31.2 m along.
    expect(preview.spacingM).toBeCloseTo(47 * 0.3, 3);
    expect(preview.triggerM).toBeCloseTo(31.2 * 0.25, 3);
    expect(preview.pixelCm).toBeCloseTo(4700 / 6000, 3);
    const lines = preview.items.filter(({ command }) => command === CMD.WAYPOINT).length / 2;
    expect(preview.pictures).toBe(lines * (Math.floor(200 / (31.2 * 0.25)) + 1));
  });

  it('says in words what cannot be, and throws nothing', () => {
    const crossing = [FIELD[0]!, FIELD[2]!, FIELD[1]!, FIELD[3]!];
    expect(patternPreview('survey', crossing, 0, typed, 3, 'ardupilot').fault).toContain('crosses itself');
    expect(patternPreview('corridor', FIELD.slice(0, 2), 0, { ...typed, spacingM: 0 }, 3, 'ardupilot').fault).toContain(
      'above 0',
    );
    expect(patternPreview('orbit', [HERE], -5, typed, 3, 'ardupilot').fault).toContain('radius');
    expect(patternPreview('survey', FIELD, 0, { ...USUAL_SETTINGS, frontOverlap: 99 }, 3, 'ardupilot').fault).toContain(
      'overlap',
    );
  });

  it('begins along the longest side of its area', () => {
    const bearings = new Map(FIELD.map((spot, at) => [spot, at % 2 === 0 ? 90 : 0]));
    expect(longestSideDeg(FIELD, (from) => bearings.get(from)!)).toBe(90);
    expect(longestSideDeg(FIELD, (from) => bearings.get(from)! - 180)).toBe(90);
  });

  it('knows each camera by a key of its own', () => {
    expect(new Set(CAMERAS.map(({ key }) => key)).size).toBe(CAMERAS.length);
  });
});

describe('work that was not saved', () => {
  function storage(): Storage & { values: Map<string, string> } {
    const values = new Map<string, string>();
    return {
      values,
      getItem: (key: string) => values.get(key) ?? null,
      setItem: (key: string, value: string) => void values.set(key, value),
      removeItem: (key: string) => void values.delete(key),
    } as unknown as Storage & { values: Map<string, string> };
  }
  const kept = { plan: PLAN, name: 'Field', library: { id: 4, version: 2 }, isSaved: false, patterns: [] };

  it('comes back as it was, to the one who did it', () => {
    const here = storage();
    expect(keepPlan(here, 5, kept)).toBe(true);
    const back = keptPlan(here, 5)!;
    expect(itemsOf(back.plan, 'mission')).toEqual(itemsOf(PLAN, 'mission'));
    expect(back).toMatchObject({ name: 'Field', library: { id: 4, version: 2 }, isSaved: false });
    expect(keptPlan(here, 6)).toBeNull();
  });

  it('that is spoilt is none, and a full browser is told', () => {
    const here = storage();
    for (const text of ['{', '7', '{"format": 1}', '{"format": 2, "document": {}}']) {
      here.values.set('tower.plan.5', text);
      expect(keptPlan(here, 5)).toBeNull();
    }
    const full = {
      ...here,
      setItem: () => {
        throw new Error('QuotaExceededError');
      },
    };
    expect(keepPlan(full, 5, kept)).toBe(false);
  });
});

describe('an item in words', () => {
  const units = { metres: (value: number) => `${value} m`, speed: (value: number) => `${value} m/s` };
  const wordsOf = (plan: Plan, seq: number): string => itemWords(plan, plan.items[seq]!, units);

  it('says what is particular about it', () => {
    const plan = add(EMPTY_PLAN, CMD.WAYPOINT, CMD.CHANGE_SPEED, CMD.TRIGGER_DISTANCE, CMD.LOITER_TIME, CMD.SET_RELAY);
    const waits = { ...plan.items[0]!, params: [12, 0, 0, null] as const };
    expect(itemWords(plan, plan.items[0]!, units)).toBe('');
    expect(itemWords(plan, waits, units)).toBe('wait at the waypoint 12 s');
    expect(wordsOf(plan, 1)).toBe('5 m/s');
    expect(wordsOf(plan, 2)).toBe('every 20 m');
    expect(wordsOf(plan, 3)).toBe('10 s');
    expect(itemWords(plan, { ...plan.items[4]!, params: [0, 1, 0, 0] }, units)).toBe('switch on');
    expect(itemWords(plan, { ...plan.items[0]!, command: 4242 }, units)).toContain('numbers');
  });

  it('names the item that a jump goes to, wherever that is now', () => {
    const plan = add(EMPTY_PLAN, CMD.WAYPOINT, CMD.WAYPOINT, CMD.JUMP);
    const jump = plan.items[2]!;
    expect(itemWords(plan, jump, units)).toBe('nowhere, 1 ×');
    const aimed = setJumpTarget(jump.id, plan.items[1]!.id).apply(plan);
    expect(wordsOf(aimed, 2)).toBe('to item 2, 1 ×');
  });
});

describe('rows that are moved', () => {
  const order = ['a', 'b', 'c', 'd'];

  it('go before the row whose middle is below the hand', () => {
    expect(rowBefore([10, 30, 50], 5)).toBe(0);
    expect(rowBefore([10, 30, 50], 31)).toBe(2);
    expect(rowBefore([10, 30, 50], 99)).toBe(3);
  });

  it('never before one of themselves', () => {
    expect(anchorFor(order, new Set(['b', 'c']), 1)).toBe('d');
    expect(anchorFor(order, new Set(['b', 'c']), 0)).toBe('a');
    expect(anchorFor(order, new Set(['d']), 4)).toBeNull();
  });

  it.each([
    ['b', true, 'a'],
    ['a', true, undefined],
    ['b', false, 'd'],
    ['c', false, null],
    ['d', false, undefined],
  ] as const)('one step: %s, up %s, before %s', (id, isUp, before) => {
    expect(anchorForStep(order, new Set([id]), isUp)).toBe(before);
  });

  it('come together where they stood apart', () => {
    expect(anchorForStep(order, new Set(['a', 'c']), true)).toBe('b');
    expect(anchorForStep(order, new Set(['b', 'd']), false)).toBeNull();
  });
});

it('a file has the name that was typed, without what a disk would choke on', () => {
  expect(savePlan(PLAN, 'Field: north/2', 'plan', 'ardupilot').name).toBe('Field north 2.plan');
  expect(savePlan(PLAN, ' ', 'kml', 'px4').name).toBe('plan.kml');
});
