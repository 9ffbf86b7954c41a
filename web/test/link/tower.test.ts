/** The console's tower: sessions, passwords, the squad and events. */

import { beforeEach, describe, expect, it } from 'vitest';

import { fromAutopilot, heartbeat, settled } from './fakes';
import { tag } from '../../src/link/tagged_frames';
import { HERON, OLGA, signedInTower, type SignedIn } from './signed_in_tower';

let answers: SignedIn['answers'];
let clock: SignedIn['clock'];
let socket: SignedIn['socket'];
let sockets: SignedIn['sockets'];
let texts: SignedIn['texts'];
let tower: SignedIn['tower'];
let vehicle: SignedIn['vehicle'];

beforeEach(async () => {
  ({ answers, clock, socket, sockets, texts, tower, vehicle } = await signedInTower());
});

describe('a new password', () => {
  const phases: string[] = [];
  beforeEach(() => {
    phases.length = 0;
    tower.live.state.subscribe(({ phase }) => phases.push(phase));
  });

  it('that is refused leaves the live connection alone', async () => {
    answers['/api/v1/me/password'] = [403, { title: 'Refused', detail: 'The present password is wrong.' }];
    await expect(tower.changePassword('wrong', 'four words are longer')).rejects.toThrow('is wrong');
    expect(phases).toEqual(['open']);
    expect(sockets).toHaveLength(1);
  });

  it('takes the live connection over to the new session, and signs nobody out meanwhile', async () => {
    answers['/api/v1/me/password'] = [200, OLGA];
    const changing = tower.changePassword('secret', 'four words are longer');
    socket().onclose?.({ code: 4401, reason: 'Your password was changed.' });
    await changing;
    socket().says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
    expect(new Set(phases)).toEqual(new Set(['open', 'connecting']));
    expect(phases.at(-1)).toBe('open');
    expect(tower.user.get()).toEqual(OLGA);
    expect(tower.farewell.get()).toBe('');
  });

  it('of somebody whose session ends for another reason afterwards signs them out', async () => {
    answers['/api/v1/me/password'] = [200, OLGA];
    await tower.changePassword('secret', 'four words are longer');
    expect(sockets).toHaveLength(2);
    socket().onclose?.({ code: 4401, reason: 'An admin has ended this session.' });
    expect(tower.user.get()).toBeNull();
  });
});

describe('the squad', () => {
  it('is what the welcome says, in a steady order', () => {
    expect([...tower.vehicles.get().keys()]).toEqual([1, 2]);
  });

  it("reads the tower's times by the tower's clock", () => {
    const ahead = (seconds: number): string => new Date(clock.nowMs() + seconds * 1000).toISOString();
    const flown = { ...HERON, airborne: true, airborne_since: ahead(3_600 - 90) };
    socket().says({ type: 'welcome', user: OLGA, drones: [flown], server_time: ahead(3_600) });
    const heard = vehicle(flown.id);
    heard.receive(heartbeat(4, true), clock.nowMs());
    heard.receive(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }), clock.nowMs());
    expect(heard.values(clock.nowMs()).airborneMs).toBe(90_000);
  });

  it('keeps what was heard of a drone when the connection comes back', async () => {
    const before = vehicle(1);
    socket().onclose?.({ code: 1006 });
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
    expect([...tower.vehicles.get().values()]).toEqual([before]);
  });

  it('takes changes, and no older epoch over a newer one', () => {
    socket().says({ type: 'drone', drone: { ...HERON, epoch: 5, holder: OLGA } });
    socket().says({ type: 'drone', drone: { ...HERON, epoch: 4, holder: null } });
    expect(vehicle(1).drone.get().holder).toEqual(OLGA);
    socket().says({ type: 'drone_removed', drone_id: 2 });
    expect([...tower.vehicles.get().keys()]).toEqual([1]);
  });

  it('keeps what was told live while a TAKE was answered, and takes an answer that nobody has told of', async () => {
    const taken = { ...HERON, epoch: 7, holder: OLGA };
    const hold = { open: true, stage: 'altitude', lost: 'person', phase: 'counting' };
    answers['/api/v1/drones/1/control/take'] = [200, taken];
    const taking = tower.control(1, 'take');
    socket().says({ type: 'drone', drone: { ...taken, hold } });
    await taking;
    expect(vehicle(1).drone.get().hold).toEqual(hold);
    answers['/api/v1/drones/1/control/release'] = [200, { ...HERON, epoch: 8, holder: null }];
    const releasing = tower.control(1, 'release');
    socket().says({ type: 'drone', drone: { ...taken, online: false } });
    await releasing;
    expect(vehicle(1).drone.get().holder).toBeNull();
  });

  it('of drones that all have the same system id is kept apart', () => {
    const message = new Uint8Array([...tag(1, heartbeat(4)), ...tag(2, heartbeat(6)), ...tag(99, heartbeat(9))]);
    socket().saysBytes(message);
    expect(vehicle(1).values(clock.nowMs()).mode).toBe('GUIDED');
    expect(vehicle(2).values(clock.nowMs()).mode).toBe('RTL');
  });

  it('does not trust a message that does not parse to its end', () => {
    socket().saysBytes(new Uint8Array([...tag(1, heartbeat(4)), 1, 2, 3]));
    expect(vehicle(1).values(clock.nowMs()).mode).toBeNull();
  });
});

describe('the session', () => {
  it('that has ended leaves nothing on screen for the next user', async () => {
    socket().onclose?.({ code: 4401 });
    expect(tower.user.get()).toBeNull();
    expect(tower.vehicles.get().size).toBe(0);
    expect(tower.journal.entries.get()).toEqual([]);
  });

  it('that the tower has ended says why, and what is flown no longer, until the next one signs in', async () => {
    socket().says({ type: 'drone', drone: { ...HERON, epoch: 5, holder: OLGA } });
    socket().onclose?.({ code: 4401, reason: 'the account was disabled' });
    expect(tower.farewell.get()).toBe(
      'You were signed out: the account was disabled. ' +
        'You have lost the controls of Heron. A drone that was in the air holds.',
    );
    await tower.signIn('olga', 'secret');
    expect(tower.farewell.get()).toBe('');
  });

  it('that we have ended ourselves needs no explanation', async () => {
    answers['/api/v1/session'] = [204, null];
    const leaving = tower.signOut();
    socket().onclose?.({ code: 4401, reason: 'the session has ended' });
    await leaving;
    expect(tower.farewell.get()).toBe('');
  });

  it('is asked for when the tower refuses the upgrade', async () => {
    answers['/api/v1/me'] = [401, {}];
    socket().onclose?.({ code: 1006 });
    await settled();
    expect(tower.user.get()).toBeNull();
    await clock.pass(60_000);
    expect(sockets).toHaveLength(1);
  });

  it('ends at the tower when signing out', async () => {
    answers['/api/v1/session'] = [204, null];
    await tower.signOut();
    expect(socket().closed).toBe(true);
    expect(tower.user.get()).toBeNull();
  });
});

describe('events', () => {
  it('are put in words, with the drone they are about', () => {
    socket().says({
      type: 'hold',
      drone_id: 1,
      epoch: 2,
      step: 'unconfirmed',
      detail: 'no answer',
      elapsed_ms: 2000.4,
    });
    socket().says({ type: 'lost', drone_id: 2, count: 12 });
    const entries = tower.journal.entries.get().map(({ droneId, severity, text }) => [droneId, severity, text]);
    expect(entries).toEqual([
      [1, 'error', 'Hold NOT CONFIRMED after 2000 ms: no answer'],
      [2, 'warning', '12 messages of this drone were lost because this browser is too slow'],
    ]);
  });

  it('are kept in a bounded number', () => {
    for (let count = 0; count < 500; count++) socket().says({ type: 'lost', drone_id: 2, count });
    expect(tower.journal.entries.get()).toHaveLength(200);
    expect(texts().at(-1)).toMatch(/^499 /);
  });
});
