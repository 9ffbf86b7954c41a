/** What a release of an autopilot lacks is not offered, and an error where a plan has it. */

import { describe, expect, it } from 'vitest';

import { missionSince } from '../../src/link/modes';
import { CATALOGUE, CMD, isKnownTo, isOffered, specOf } from '../../src/plan/catalogue';
import { firmwareOf } from '../../src/plan/firmware';
import { planChecks } from '../../src/plan/plan_checks';
import { EMPTY_PLAN } from '../../src/plan/plan_types';
import { wireItem, withItems } from '../../src/plan/wire_items';

const LIMITS = { highestM: null, farthestM: null } as const;
const OLD = { firmware: '4.6.2', release: [4, 6] };
const NEW = { firmware: '4.7.0', release: [4, 7] };

describe('the release of an ArduPilot', () => {
  it.each([
    ['4.5', { firmware: '4.5.7', release: [4, 5] }, [CMD.ROI_LOCATION, CMD.ROI_NONE]],
    ['4.6', OLD, [CMD.ROI_LOCATION, CMD.ROI_NONE]],
    ['4.7', NEW, []],
    ['one not known', { firmware: null, release: null }, []],
    ['an older tower', undefined, []],
  ])('%s decides what is offered', (_, drone, missing) => {
    const { lacks } = firmwareOf(drone, missionSince('ardupilot'));
    const offered = (from: ReadonlySet<number>): number[] =>
      [...CATALOGUE.values()].filter((one) => isOffered(one, 'ardupilot', from)).map(({ command }) => command);
    const without = new Set(offered(lacks));
    expect(offered(new Set()).filter((command) => !without.has(command))).toEqual(missing);
  });

  it('is no matter of a PX4', () => {
    expect(firmwareOf({ firmware: '1.15.4', release: [1, 15] }, missionSince('px4')).lacks.size).toBe(0);
  });

  it('makes an item that it lacks an error, with its number', () => {
    const item = wireItem(CMD.ROI_LOCATION, 3, [0, 0, 0, 0], 473_977_000, 85_455_000, 5);
    const { plan } = withItems(EMPTY_PLAN, 'mission', [item]);
    const words = (drone: typeof OLD): string[] =>
      planChecks(plan, { ...LIMITS, autopilot: 'ardupilot', firmware: firmwareOf(drone, missionSince('ardupilot')) })
        .filter(({ severity }) => severity === 'error')
        .map((one) => one.words);
    expect(words(OLD)).toContain(
      'Item 1 (Look at (ROI)) is not a part of missions of ArduPilot 4.6.2; later releases have it.',
    );
    expect(words(NEW).join()).not.toContain('is not a part');
    expect(isKnownTo(specOf(CMD.ROI)!, 'ardupilot')).toBe(true);
  });
});
