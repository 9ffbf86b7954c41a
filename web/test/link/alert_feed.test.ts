import { beforeEach, describe, expect, it } from 'vitest';

import { Tower } from '../../src/link/tower';
import { Rest } from '../../src/link/rest';
import { tag } from '../../src/link/tagged_frames';
import { A_DRONE, FakeClock, FakeSocket, fromAutopilot, heartbeat } from './fakes';

const OLGA = { id: 5, name: 'olga', role: 'operator' };
const HERON = { ...A_DRONE, holder: { id: 5, name: 'olga' } };

let clock: FakeClock;
let socket: FakeSocket;
let tower: Tower;
const alerts = (): string[] => tower.alertFeed.alerts.list.get().map(({ severity, text }) => `${severity}: ${text}`);

beforeEach(async () => {
  clock = new FakeClock();
  socket = new FakeSocket();
  const rest = new Rest(() => Promise.resolve(new Response(JSON.stringify(OLGA), { status: 200 })));
  tower = new Tower({ clock, rest, openSocket: () => socket });
  await tower.signIn('olga', 'secret');
  socket.says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
  socket.saysBytes(tag(1, heartbeat(4)));
});

describe('alerts come from', () => {
  it('what the autopilot warns of, in one piece however many it came in', () => {
    const long = 'PreArm: the compass is not calibrated, and that t';
    const text = (words: string, severity: number, id = 0, chunk_seq = 0) =>
      socket.saysBytes(tag(1, fromAutopilot('STATUSTEXT', { severity, text: words, id, chunk_seq })));
    text('Taking off', 6);
    text(long.padEnd(50, '.'), 2, 9, 0);
    text(' is the end', 2, 9, 1);
    expect(alerts()).toEqual([`critical: ${long.padEnd(50, '.')} is the end`]);
  });

  it('holds: that none was needed after all', () => {
    const hold = { type: 'hold', drone_id: 1, epoch: 2, detail: '', elapsed_ms: 5, cause: 'order' };
    socket.says({ ...hold, step: 'ordered' });
    expect(alerts()).toEqual(['warning: Put on hold: ordered by the tower.']);
    socket.says({ ...hold, step: 'not_needed', detail: 'the drone is disarmed' });
    expect(alerts()).toEqual(['warning: No hold was needed: the drone is disarmed.']);
  });

  it('holds: that one was ordered, and that one is not confirmed', () => {
    const hold = { type: 'hold', drone_id: 1, epoch: 2, detail: '', elapsed_ms: 5, cause: 'pilot-lost' };
    for (const step of ['ordered', 'sticks_centred', 'confirmed']) socket.says({ ...hold, step });
    expect(alerts()).toEqual(['warning: Put on hold: the pilot or the tower was lost.']);
    socket.says({ ...hold, step: 'unconfirmed', detail: 'no answer' });
    expect(alerts()[1]).toContain('critical: Hold NOT CONFIRMED');
  });

  it('a silent autopilot, when it is found silent twice', async () => {
    await clock.pass(5_500);
    tower.look();
    expect(alerts()).toEqual([]);
    tower.look();
    expect(alerts()).toEqual(['warning: Its autopilot is silent.']);
  });

  it('no page that stood still while messages were waiting', async () => {
    await clock.pass(5_500);
    tower.look();
    socket.saysBytes(tag(1, heartbeat(4)));
    tower.look();
    await clock.pass(5_500);
    tower.look();
    expect(alerts()).toEqual([]);
  });

  it('nobody once signed out', async () => {
    socket.says({ type: 'hold', drone_id: 1, epoch: 2, detail: '', elapsed_ms: 5, step: 'unconfirmed' });
    await tower.signOut();
    expect(alerts()).toEqual([]);
  });
});
