import { describe, expect, it } from 'vitest';

import { missionPhase, whyNotMove, type MissionFacts, type MissionMove } from '../../src/link/mission_moves';

const [ACTIVE, PAUSED] = [3, 4];
const FACTS: MissionFacts = {
  count: 5,
  airborne: true,
  isFlown: false,
  task: 'by-itself',
  missionState: null,
  wasPaused: false,
};
const phase = (facts: Partial<MissionFacts>): string => missionPhase({ ...FACTS, ...facts });

describe('the phase of a mission', () => {
  it.each<[string, Partial<MissionFacts>]>([
    ['unknown', { count: null }],
    ['none', { count: 0 }],
    ['ready', { airborne: false }],
    ['flown', { isFlown: true, task: 'mission', missionState: ACTIVE }],
    ['flown', { isFlown: true, task: 'mission' }],
    ['paused', { isFlown: true, task: 'mission', missionState: PAUSED }],
    // ArduCopter pauses in another mode; some autopilots report no state of the mission.
    ['paused', { missionState: PAUSED }],
    ['paused', { wasPaused: true }],
    ['elsewhere', { wasPaused: true, task: 'return' }],
    ['elsewhere', {}],
  ])('is %s', (expected, facts) => {
    expect(phase(facts)).toBe(expected);
  });
});

describe('the moves', () => {
  it.each([
    ['unknown', ['pause']],
    ['none', []],
    ['ready', ['start']],
    ['flown', ['pause', 'jump']],
    ['paused', ['start', 'resume', 'jump']],
    ['elsewhere', ['start', 'resume', 'jump']],
  ] as const)('while it is %s', (now, expected) => {
    const moves: MissionMove[] = ['start', 'pause', 'resume', 'jump'];
    expect(moves.filter((move) => whyNotMove(move, now) === '')).toEqual(expected);
  });

  it('of a mission that may be incomplete: only to stop it', () => {
    expect(whyNotMove('start', 'ready', true)).toContain('incomplete');
    expect(whyNotMove('pause', 'flown', true)).toBe('');
  });
});
