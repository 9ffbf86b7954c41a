import { describe, expect, it } from 'vitest';

import { MAV_RESULT } from '../../src/link/generated/mavlink.gen';
import type { User } from '../../src/link/wire_types';
import { answerOf, wayToControls } from '../../src/squad/squad_action';
import { A_DRONE } from '../link/fakes';

const BOSS: User = { id: 1, name: 'boss', role: 'admin' };
const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const HELD = { ...A_DRONE, holder: { id: 5, name: 'olga' } };

describe('the way to the controls', () => {
  it.each([
    ['an admin takes what another holds', HELD, BOSS, 'take'],
    ['an admin takes up what is free', A_DRONE, BOSS, 'acquire'],
    ['an admin needs none for their own', { ...A_DRONE, holder: { id: 1, name: 'boss' } }, BOSS, null],
    ['an admin has none to what is not there', { ...HELD, online: false }, BOSS, null],
    ['an operator has none in a squad action: they hold one drone at most', A_DRONE, OLGA, null],
  ] as const)('%s', (_, drone, user, expected) => {
    expect(wayToControls(drone, user)).toBe(expected);
  });
});

describe('the answer of a drone', () => {
  it('is done, refused with the reason, or none', () => {
    expect(answerOf('Heron', { kind: 'accepted' }).kind).toBe('done');
    expect(answerOf('Heron', { kind: 'refused', result: MAV_RESULT.DENIED })).toEqual({
      kind: 'refused',
      why: 'Heron denied it',
    });
    expect(answerOf('Heron', { kind: 'no-answer' }).kind).toBe('no-answer');
    expect(answerOf('Heron', { kind: 'unconfirmed', detail: 'no BRAKE' }).kind).toBe('unconfirmed');
    expect(answerOf('Heron', { kind: 'failed', why: 'not sent' }).kind).toBe('refused');
  });
});
