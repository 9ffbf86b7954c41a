import { beforeEach, describe, expect, it } from 'vitest';

import { MAV_RESULT } from '../../src/link/generated/mavlink.gen';
import { Rest } from '../../src/link/rest';
import { decode } from '../../src/link/mavlink';
import { CENTRED } from '../../src/link/sticks';
import { splitTagged, tag } from '../../src/link/tagged_frames';
import { Tower } from '../../src/link/tower';
import { A_DRONE, FakeClock, FakeSocket, fromAutopilot, heartbeat, settled } from './fakes';

const OLGA = { id: 5, name: 'olga', role: 'operator' };
const HERON = A_DRONE;
const SWIFT = { ...A_DRONE, id: 2, name: 'Swift' };

let clock: FakeClock;
let sockets: FakeSocket[];
let tower: Tower;
let answers: Record<string, [number, unknown]>;
const socket = (): FakeSocket => sockets.at(-1)!;
const texts = (): string[] => tower.journal.entries.get().map(({ text }) => text);
const vehicle = (id: number) => tower.vehicles.get().get(id)!;

beforeEach(async () => {
  clock = new FakeClock();
  sockets = [];
  answers = { '/api/v1/session': [200, OLGA], '/api/v1/me': [200, OLGA] };
  const rest = new Rest((path) => {
    const [status, body] = answers[path] ?? [404, { title: 'Not found', detail: 'There is no such thing.' }];
    return Promise.resolve(new Response(status === 204 ? null : JSON.stringify(body), { status }));
  });
  const openSocket = (): FakeSocket => {
    const made = new FakeSocket();
    sockets.push(made);
    return made;
  };
  tower = new Tower({ clock, rest, openSocket });
  await tower.signIn('olga', 'secret');
  socket().says({ type: 'welcome', user: OLGA, drones: [SWIFT, HERON], server_time: '' });
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

describe('commands', () => {
  beforeEach(() => socket().saysBytes(tag(1, heartbeat(4))));

  const COMMANDS = '/api/v1/drones/1/commands';
  const LANDS = { id: '9', drone_id: 1, work: 'command', state: 'running', words: '' };

  it('go to the tower as operations, and their answers come back', async () => {
    answers[COMMANDS] = [202, LANDS];
    const result = vehicle(1).command('Land', { command: 'land' });
    await settled();
    expect(socket().sent).toEqual([]);
    const operation = { ...LANDS, state: 'done', words: 'Heron has accepted it: changing to LAND.' };
    socket().says({ type: 'operation', operation });
    expect(await result).toEqual({ kind: 'told', isDone: true, words: operation.words });
    expect(texts()).toContain(`Land: ${operation.words}`);
  });

  it('survive a broken connection: how they ended is asked when it is back', async () => {
    answers[COMMANDS] = [202, LANDS];
    const result = vehicle(1).command('Land', { command: 'land' });
    await settled();
    socket().onclose?.({ code: 1006 });
    await clock.pass(600);
    answers['/api/v1/operations/9'] = [200, { ...LANDS, state: 'failed', words: 'Heron, changing to LAND: denied.' }];
    socket().says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
    expect(await result).toEqual({ kind: 'told', isDone: false, words: 'Heron, changing to LAND: denied.' });
    expect(socket().sent).toEqual([]);
  });

  it('that the tower refuses are over, with its words', async () => {
    answers[COMMANDS] = [409, { title: 'No', detail: 'boss has the controls of Heron.' }];
    const result = await vehicle(1).command('Arm', { command: 'arm' });
    expect(result).toEqual({ kind: 'told', isDone: false, words: 'boss has the controls of Heron.' });
  });

  it('end where the tower cannot be told what it must know first', async () => {
    const before = () => Promise.reject(new Error('The name is another.'));
    const result = await vehicle(1).command('Arm', { command: 'arm' }, before);
    expect(result).toEqual({ kind: 'failed', why: 'The name is another.' });
  });
});

describe('hold', () => {
  beforeEach(() => socket().saysBytes(tag(1, heartbeat(4))));

  it('goes through the socket and its answer comes back', async () => {
    const result = vehicle(1).sendHold();
    expect(socket().frames).toHaveLength(1);
    socket().saysBytes(tag(2, fromAutopilot('COMMAND_ACK', { command: 176, result: MAV_RESULT.FAILED })));
    socket().saysBytes(tag(1, fromAutopilot('COMMAND_ACK', { command: 176, result: MAV_RESULT.ACCEPTED })));
    socket().saysBytes(tag(1, heartbeat(17)));
    expect(await result).toEqual({ kind: 'accepted' });
  });

  it('ends at once when the tower refuses our frames, with its words', async () => {
    const result = vehicle(1).sendHold();
    const refusal = { severity: 'warning', code: 'not-in-control', text: 'Not yours.', drone_id: 1, count: 3 };
    socket().says({ type: 'notice', ...refusal });
    expect(await result).toEqual({ kind: 'failed', why: 'Not yours.' });
    expect(texts()).toContain('Not yours. (3 times)');
  });

  it('ends when the connection breaks, and is not sent again later', async () => {
    const result = vehicle(1).sendHold();
    socket().onclose?.({ code: 1006 });
    expect((await result).kind).toBe('failed');
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
    await clock.pass(10_000);
    expect(socket().sent).toEqual([]);
  });

  it('ends when an admin takes the controls', async () => {
    const result = vehicle(1).sendHold();
    const boss = { id: 1, name: 'boss' };
    socket().says({ type: 'control', drone_id: 1, event: 'taken', epoch: 2, holder: boss, by: boss, reason: 'storm' });
    expect((await result).kind).toBe('failed');
    expect(texts()).toContain('boss TOOK the controls of Heron: storm');
  });
});

describe('who may fly', () => {
  const boss = { id: 1, name: 'boss' };
  const mine = { ...HERON, holder: OLGA, epoch: 2 };
  const taken = { ...HERON, holder: boss, taken_from: OLGA, epoch: 3 };
  beforeEach(() => {
    socket().saysBytes(tag(1, heartbeat(4)));
    socket().says({ type: 'drone', drone: mine });
  });
  const flyByHand = (): void =>
    vehicle(1).manual.start({ name: 'pad', read: () => ({ roll: 0, pitch: 0, yaw: 0, throttle: 0 }) });

  it('sends sticks with a stamp, and stops them with the controls', async () => {
    flyByHand();
    await clock.pass(60);
    const frames = socket().frames.map((one) => decode(splitTagged(one)![0]!.frame)!);
    expect(frames.map(({ name }) => name)).toEqual(Array(4).fill('MANUAL_CONTROL'));
    expect(frames[0]!.fields).toMatchObject({ target: 7, x: 0, y: 0, z: 500, r: 0 });
    socket().says({ type: 'drone', drone: taken });
    await clock.pass(1_000);
    expect(vehicle(1).manual.state.get().phase).toBe('off');
    expect(socket().frames).toHaveLength(4);
    expect(tower.lostControls.losses.get().get(1)).toMatchObject({ kind: 'taken', by: boss });
  });

  it('does not go on with the sticks after a reconnection', async () => {
    flyByHand();
    socket().onclose?.({ code: 1006 });
    expect(vehicle(1).manual.state.get()).toMatchObject({ phase: 'off' });
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [mine], server_time: '' });
    await clock.pass(1_000);
    expect(socket().frames).toEqual([]);
  });

  it('tells what happened to the controls while the page was away', async () => {
    socket().onclose?.({ code: 1006 });
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [{ ...HERON, epoch: 9 }], server_time: '' });
    expect(tower.lostControls.losses.get().get(1)).toMatchObject({ kind: 'expired', droneName: 'Heron' });
  });

  it('lets an assisting admin command, and the holder wait', async () => {
    socket().says({ type: 'drone', drone: { ...mine, assistant: boss, epoch: 4 } });
    socket().says({ type: 'turn', drone_id: 1, user: boss });
    expect(tower.assist.turns.get().get(1)).toEqual(boss);
    const result = vehicle(1).sendHold();
    const refusal = { severity: 'warning', code: 'assisted', text: 'boss assists.', drone_id: 1, count: 1 };
    socket().says({ type: 'notice', ...refusal });
    expect(await result).toEqual({ kind: 'failed', why: 'boss assists.' });
    socket().says({ type: 'drone', drone: { ...mine, epoch: 5 } });
    expect(tower.assist.turns.get().size).toBe(0);
  });

  it('stops the sticks when another window of the same pilot flies already, and holds nothing: that one flies on', async () => {
    socket().says({ type: 'drone', drone: { ...HERON, epoch: 5, holder: OLGA } });
    socket().saysBytes(tag(1, heartbeat(5, true)));
    const { manual } = vehicle(1);
    manual.start({ name: 'pad', read: () => CENTRED });
    await clock.pass(40);
    expect(manual.state.get().phase).toBe('flying');
    const before = socket().frames.length;
    const notice = { severity: 'warning', code: 'other-hands', text: 'Another window.', drone_id: 1, count: 1 };
    socket().says({ type: 'notice', ...notice });
    await clock.pass(200);
    expect(manual.state.get()).toMatchObject({ phase: 'off', ended: 'another window or program of yours flies it' });
    expect(socket().frames.length).toBe(before);
  });

  it('reads the check before flight when the tower refuses an arming for it', async () => {
    const check = { complete: true, has_radio: null, sentences: [], dangerous: true, acknowledged: false };
    answers['/api/v1/drones/1/loss-check'] = [200, check];
    const notice = { severity: 'warning', code: 'loss-check', text: 'Read it first.', drone_id: 1, count: 1 };
    socket().says({ type: 'notice', ...notice });
    await settled();
    expect(vehicle(1).lossCheck.get()).toEqual(check);
  });

  it('reads the check before flight anew when the tower says that it has changed, and after a reconnection', async () => {
    const check = { complete: true, has_radio: null, sentences: [], dangerous: false, acknowledged: false };
    answers['/api/v1/drones/1/loss-check'] = [200, check];
    tower.lossChecks.watch(1, () => undefined);
    await settled();
    expect(vehicle(1).lossCheck.get()).toEqual(check);
    answers['/api/v1/drones/1/loss-check'] = [200, { ...check, dangerous: true }];
    socket().says({ type: 'loss_check', drone_id: 2 });
    socket().says({ type: 'loss_check', drone_id: 1 });
    await settled();
    expect(vehicle(1).lossCheck.get()).toMatchObject({ dangerous: true });
    answers['/api/v1/drones/1/loss-check'] = [200, { ...check, dangerous: true, acknowledged: true }];
    socket().onclose?.({ code: 1006 });
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [HERON], server_time: '' });
    await settled();
    expect(vehicle(1).lossCheck.get()).toMatchObject({ acknowledged: true });
  });

  it('says who took a drone out of the squad that we flew, by its name', () => {
    socket().says({ type: 'drone', drone: { ...mine, epoch: 3 } });
    socket().says({ type: 'drone_removed', drone_id: 1 });
    expect(tower.lostControls.losses.get().get(1)).toMatchObject({ kind: 'removed', isGone: true });
    const reason = 'no longer an owner of this drone';
    socket().says({ type: 'control', drone_id: 1, event: 'revoked', epoch: 4, holder: null, by: boss, reason });
    expect(tower.lostControls.losses.get().get(1)).toMatchObject({
      kind: 'revoked',
      droneName: 'Heron',
      by: boss,
      reason,
      isGone: true,
    });
    expect(texts()).toContain(`The controls of Heron were revoked by boss: ${reason}`);
  });

  it('keeps the hold and the rehearsal with their drone', () => {
    const hold = { type: 'hold', drone_id: 1, epoch: 3, detail: '', cause: 'pilot-lost' };
    socket().says({ ...hold, step: 'ordered', elapsed_ms: 0 });
    socket().says({ ...hold, step: 'confirmed', elapsed_ms: 7 });
    expect(vehicle(1).holdLog.get()).toMatchObject({ phase: 'confirmed', confirmedMs: 7, cause: 'pilot-lost' });
    socket().says({
      type: 'rehearsal',
      drone_id: 1,
      what: 'tower',
      phase: 'held',
      hold_ms: 2003,
      text: 'It holds.',
      lasts_s: 4,
    });
    expect(vehicle(1).rehearsal.get()).toMatchObject({ phase: 'held', hold_ms: 2003 });
    expect(vehicle(2).holdLog.get()).toBeNull();
    expect(texts()).toContain('Rehearsal: It holds.');
  });

  it('ends flying by hand with a hold, whoever ordered it: what flies again is a new beginning', async () => {
    socket().saysBytes(tag(1, heartbeat(5)));
    const { manual } = vehicle(1);
    manual.start({ name: 'pad', read: () => CENTRED });
    await clock.pass(100);
    expect(manual.state.get().phase).toBe('flying');
    socket().says({ type: 'hold', drone_id: 1, epoch: 2, step: 'ordered', detail: '', elapsed_ms: 0, cause: 'order' });
    await clock.pass(100);
    expect(manual.state.get()).toMatchObject({ phase: 'off' });
    expect(manual.state.get().ended).toContain('put on hold');
    expect(clock.waiting).toBeLessThan(5); // no beat goes on
  });

  it('remembers since when a drone is silent, and whether it was in the air', async () => {
    socket().says({ type: 'drone', drone: { ...mine, airborne: true, epoch: 2 } });
    await clock.pass(500);
    const atMs = clock.nowMs();
    socket().says({ type: 'drone', drone: { ...mine, airborne: null, online: false, epoch: 2 } });
    expect(vehicle(1)).toMatchObject({ silentSinceMs: atMs, wasAirborne: true });
    // Back, but its autopilot is silent: what was known last stays true as far as anybody knows.
    socket().says({ type: 'drone', drone: { ...mine, armed: null, airborne: null, epoch: 2 } });
    expect(vehicle(1).wasAirborne).toBe(true);
    socket().says({ type: 'drone', drone: { ...mine, epoch: 2 } });
    expect(vehicle(1)).toMatchObject({ silentSinceMs: null, wasAirborne: false });
  });

  it('remembers since when we do not hear the tower', async () => {
    const atMs = clock.nowMs();
    await clock.pass(1_000);
    socket().onclose?.({ code: 1006 });
    expect(tower.deafSinceMs.get()).toBe(atMs);
    await clock.pass(600);
    socket().says({ type: 'welcome', user: OLGA, drones: [mine], server_time: '' });
    expect(tower.deafSinceMs.get()).toBeNull();
  });

  it('is not shaken by what it does not know', () => {
    const event = { type: 'control', drone_id: 1, event: 'tomorrow', epoch: 9, holder: null, by: null, reason: '' };
    socket().says(event);
    socket().says({ ...event, drone_id: 4711, event: 'revoked' });
    socket().says({ type: 'turn', drone_id: 4711, user: boss });
    socket().says({ type: 'hold', drone_id: 4711, epoch: 1, step: 'tomorrow', detail: '', elapsed_ms: 0 });
    socket().says({ type: 'rehearsal', drone_id: 4711, what: 'sun', phase: 'dawn', hold_ms: null, text: '' });
    socket().says({ type: 'drone_removed', drone_id: 4711 });
    expect(texts()).toContain('The controls of Heron changed (tomorrow), nobody has the controls');
    expect(tower.lostControls.losses.get().size).toBe(0);
  });
});

describe('work at a drone', () => {
  const operation = { id: 'a1', drone_id: 1, work: 'plan_upload', kind: 'mission', state: 'running', words: '' };
  const board = {
    kind: 'mission',
    state: 'known',
    hash: 'aaaaaaaaaaaaaaaa',
    sent_hash: null,
    count: 3,
    fit_to_fly: true,
  };

  it('is followed, and its end is in the journal once', () => {
    socket().says({ type: 'operation', operation });
    expect(tower.operations.all.get().get('a1')!.state).toBe('running');
    const ended = { ...operation, state: 'failed', words: 'Item 3 was refused; the old mission is untouched.' };
    socket().says({ type: 'operation', operation: ended });
    socket().says({ type: 'operation', operation: ended });
    expect(texts().filter((text) => text.includes('Item 3'))).toHaveLength(1);
  });

  it('shows in what is on board, as the first picture and then each change says', () => {
    socket().says({ type: 'drone', drone: { ...HERON, plans: { mission: board }, parameters: null } });
    expect(vehicle(1).plans.get().mission?.count).toBe(3);
    socket().says({ type: 'plan_on_board', drone_id: 1, ...board, hash: null, state: 'unknown' });
    expect(vehicle(1).plans.get().mission?.hash).toBeNull();
    socket().says({ type: 'drone', drone: { ...HERON, armed: true } });
    expect(vehicle(1).plans.get().mission?.state).toBe('unknown');
    socket().says({ type: 'parameters', drone_id: 1, hash: null, count: 20, total: 1400 });
    expect(vehicle(1).parameters.get()).toMatchObject({ count: 20, total: 1400 });
  });

  it("tells how far a mission is, in the plan's numbers", () => {
    socket().saysBytes(tag(1, heartbeat(3)));
    socket().saysBytes(tag(1, fromAutopilot('MISSION_CURRENT', { seq: 4 })));
    expect(vehicle(1).mission.now.get().current).toBe(3);
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
        'You had the controls of Heron: you have them no longer, and the drone holds if it was in the air.',
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
      [2, 'warning', '12 messages of this drone were lost: this browser is too slow'],
    ]);
  });

  it('are kept in a bounded number', () => {
    for (let count = 0; count < 500; count++) socket().says({ type: 'lost', drone_id: 2, count });
    expect(tower.journal.entries.get()).toHaveLength(200);
    expect(texts().at(-1)).toMatch(/^499 /);
  });
});
