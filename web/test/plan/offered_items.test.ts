/** Compares the items that the console offers with the file that Python's tests check (wire/plan_keeping.py). */

import { readFileSync } from 'node:fs';

import { describe, expect, it } from 'vitest';

import { CATALOGUE, CMD, isKnownTo, isOffered, isOpenTo, specOf, type AutopilotKind } from '../../src/plan/catalogue';
import { newItem } from '../../src/plan/edits';
import { planChecks } from '../../src/plan/plan_checks';
import { EMPTY_PLAN, spotOf } from '../../src/plan/plan_types';
import { rowOf } from '../../src/plan/wire_items';

const GOLDEN = new URL('../../../tests/unit/wire/golden/offered_items.json', import.meta.url);
const HERE = spotOf(47.39, 8.54);

/** A new item of each kind, with the plan's defaults and a place if it has one. */
const offered = (autopilot: AutopilotKind): unknown[] =>
  [...CATALOGUE.values()]
    .filter((spec) => isOffered(spec, autopilot))
    .map(({ command }) => rowOf(newItem(EMPTY_PLAN.defaults, command, HERE)));

describe('a new item of each kind that is offered', () => {
  it('is the one that Python holds against the autopilots', () => {
    const made = { ardupilot: offered('ardupilot'), px4: offered('px4') };
    expect(JSON.parse(readFileSync(GOLDEN, 'utf8'))).toEqual(made);
  });

  it('is known to the autopilot that it is offered for', () => {
    for (const autopilot of ['ardupilot', 'px4'] as const) {
      const specs = [...CATALOGUE.values()].filter((spec) => isOffered(spec, autopilot));
      expect(specs.every((spec) => isKnownTo(spec, autopilot))).toBe(true);
      expect(specs.length).toBeGreaterThan(20);
    }
    expect(isOffered(specOf(CMD.SET_SERVO)!, 'px4')).toBe(false);
    expect(isOffered(specOf(CMD.SET_HOME)!, 'px4')).toBe(false);
    expect(isKnownTo(specOf(CMD.SET_HOME)!, 'px4')).toBe(true);
  });

  it('has an open parameter only where the autopilot takes one', () => {
    const [pitch] = specOf(CMD.GIMBAL_PITCH_YAW)!.params;
    expect([
      isOpenTo(CMD.GIMBAL_PITCH_YAW, pitch!, 'ardupilot'),
      isOpenTo(CMD.GIMBAL_PITCH_YAW, pitch!, 'px4'),
    ]).toEqual([false, true]);
    const item = { ...newItem(EMPTY_PLAN.defaults, CMD.GIMBAL_PITCH_YAW, null), params: [null, 0, 0, 0] as const };
    const plan = { ...EMPTY_PLAN, items: [{ ...item, id: 1, jumpTo: null }] };
    const words = (autopilot: AutopilotKind): string[] =>
      planChecks(plan, { autopilot, highestM: null, farthestM: null })
        .filter(({ severity }) => severity === 'error')
        .map((one) => one.words);
    expect(words('ardupilot')).toEqual(['Item 1 (Gimbal) is not right. Pitch: ArduPilot needs a number.']);
    expect(words('px4')).toEqual([]);
  });
});
