import { describe, expect, it } from 'vitest';

import { mayCommand, readDrone } from '../../src/link/drone_view';
import type { Drone, User } from '../../src/link/wire_types';
import { blockedWords, flyingWords, type Situation } from '../../src/words/blocked';
import { A_DRONE } from '../link/fakes';

const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const BOSS: User = { id: 1, name: 'boss', role: 'admin' };
const MINE: Drone = { ...A_DRONE, holder: OLGA };
const blocked = (more: Partial<Situation>): string =>
  blockedWords({ drone: MINE, user: OLGA, isConnected: true, isHeard: true, waitsFor: null, ...more });

describe('why nothing can be commanded', () => {
  it('is nothing for the holder, and for who assists', () => {
    expect(blocked({})).toBe('');
    const assisted = { ...MINE, assistant: BOSS };
    expect(blocked({ drone: assisted, user: BOSS })).toBe('');
    expect(flyingWords(assisted, OLGA)).toBe('You fly Heron, boss assists');
    expect(flyingWords(assisted, BOSS)).toContain('You assist olga with Heron');
  });

  it.each<[string, Partial<Situation>]>([
    ['The connection to the tower is down', { isConnected: false }],
    ['is offline', { drone: { ...MINE, online: false } }],
    ['Take control', { drone: A_DRONE }],
    ['boss has the controls.', { drone: { ...A_DRONE, holder: BOSS } }],
    ['They were taken from you', { drone: { ...A_DRONE, holder: BOSS, taken_from: OLGA } }],
    ['accept the controls first', { drone: { ...A_DRONE, holder: BOSS, taken_from: OLGA, offered: true } }],
    ['boss assists: your commands wait', { drone: { ...MINE, assistant: BOSS }, waitsFor: BOSS }],
    ['No heartbeat', { isHeard: false }],
  ])('is said: %s', (words, situation) => {
    expect(blocked(situation)).toContain(words);
  });
});

describe('a drone from an older tower', () => {
  it('may be watched, is not assisted, and keeps what it says', () => {
    const { id, name, online, owners, holder, epoch, taken_from, autopilot_heard } = MINE;
    const drone = readDrone({ id, name, online, owners, holder, epoch, taken_from, autopilot_heard });
    expect(drone).toEqual({ ...MINE, armed: null, airborne: null });
    expect(readDrone({ ...MINE, may_watch: false, lost_action_s: 9 })).toMatchObject({
      may_watch: false,
      lost_action_s: 9,
    });
    expect(mayCommand(drone, OLGA)).toBe(true);
    expect(mayCommand(drone, BOSS)).toBe(false);
  });
});
