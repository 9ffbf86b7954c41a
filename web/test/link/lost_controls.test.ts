import { beforeEach, describe, expect, it } from 'vitest';

import { LostControlsLog } from '../../src/link/lost_controls';
import type { ControlEvent, Drone, User } from '../../src/link/wire_types';
import { A_DRONE } from './fakes';

const OLGA: User = { id: 5, name: 'olga', role: 'operator' };
const BOSS = { id: 1, name: 'boss' };
const MINE: Drone = { ...A_DRONE, holder: OLGA, epoch: 4 };
const TAKEN: Drone = { ...A_DRONE, holder: BOSS, taken_from: OLGA, epoch: 5 };
const FREE: Drone = { ...A_DRONE, holder: null, epoch: 5 };

const event = (kind: string, more: Partial<ControlEvent> = {}): ControlEvent => ({
  type: 'control',
  drone_id: 1,
  event: kind,
  epoch: 5,
  holder: null,
  by: BOSS,
  reason: 'storm',
  ...more,
});

let log: LostControlsLog;
const loss = () => log.losses.get().get(1);

beforeEach(() => {
  log = new LostControlsLog();
  log.drone(null, MINE, OLGA, 100);
});

describe('losing the controls', () => {
  it('to an admin says so at once, and then why', () => {
    log.drone(MINE, TAKEN, OLGA, 200);
    expect(loss()).toMatchObject({ kind: 'taken', by: BOSS, reason: '', atMs: 200 });
    log.control(event('taken', { holder: BOSS }), 'Heron', OLGA, 201);
    expect(loss()).toMatchObject({ kind: 'taken', by: BOSS, reason: 'storm', atMs: 200, isGone: false });
  });

  it('before this page was opened has no time', () => {
    log = new LostControlsLog();
    log.drone(null, TAKEN, OLGA, 200);
    expect(loss()).toMatchObject({ kind: 'taken', by: BOSS, atMs: null });
  });

  it.each(['revoked', 'expired'])('that were %s is told by the event', (kind) => {
    log.drone(MINE, FREE, OLGA, 200);
    expect(loss()).toBeUndefined();
    log.control(event(kind), 'Heron', OLGA, 201);
    expect(loss()).toMatchObject({ kind, reason: 'storm', atMs: 201 });
  });

  it('by releasing them is no loss', () => {
    log.drone(MINE, FREE, OLGA, 200);
    log.control(event('released', { by: OLGA }), 'Heron', OLGA, 201);
    expect(loss()).toBeUndefined();
    // and events of the next holder do not concern us
    log.control(event('revoked', { epoch: 7 }), 'Heron', OLGA, 300);
    expect(loss()).toBeUndefined();
  });

  it('together with the drone is told, in whichever order it is said', () => {
    log.removed(MINE, OLGA, 200);
    expect(loss()).toMatchObject({ kind: 'removed', droneName: 'Heron', isGone: true });
    log.control(event('revoked'), 'Heron', OLGA, 201);
    expect(loss()).toMatchObject({ kind: 'revoked', reason: 'storm', isGone: true });

    log = new LostControlsLog();
    log.drone(MINE, FREE, OLGA, 200);
    log.control(event('revoked'), 'Heron', OLGA, 201);
    log.removed(FREE, OLGA, 202);
    expect(loss()).toMatchObject({ kind: 'revoked', reason: 'storm', isGone: true });
  });

  it('during a disconnection is told after it', () => {
    log.drone(MINE, FREE, OLGA, 200);
    log.unexplained(FREE, 201);
    expect(loss()).toMatchObject({ kind: 'expired' });
    expect(loss()!.reason).toContain('not connected');
  });

  it('is over when they are ours again, or nobody keeps them from us', () => {
    log.drone(MINE, TAKEN, OLGA, 200);
    log.drone(TAKEN, { ...MINE, epoch: 6 }, OLGA, 300);
    expect(loss()).toBeUndefined();
    log.drone(MINE, TAKEN, OLGA, 400);
    log.drone(TAKEN, { ...TAKEN, taken_from: null, epoch: 7 }, OLGA, 500);
    expect(loss()).toBeUndefined();
  });

  it('of somebody else is not ours', () => {
    const bob: User = { id: 6, name: 'bob', role: 'operator' };
    log = new LostControlsLog();
    log.drone(MINE, TAKEN, bob, 200);
    log.control(event('taken', { holder: BOSS }), 'Heron', bob, 201);
    log.removed(TAKEN, bob, 202);
    expect(log.losses.get().size).toBe(0);
  });
});
