/** The console's tower in flight: commands, controls, and operations at a drone. */

import { beforeEach, describe, expect, it } from 'vitest';

import { MAV_RESULT } from '../../src/link/generated/mavlink.gen';
import { CENTRED_MS } from '../../src/link/manual';
import { decode } from '../../src/link/mavlink';
import { CENTRED } from '../../src/link/sticks';
import { splitTagged, tag } from '../../src/link/tagged_frames';
import { fromAutopilot, heartbeat, settled } from './fakes';
import { HERON, OLGA, signedInTower, type SignedIn } from './signed_in_tower';

let answers: SignedIn['answers'];
let clock: SignedIn['clock'];
let socket: SignedIn['socket'];
let texts: SignedIn['texts'];
let tower: SignedIn['tower'];
let vehicle: SignedIn['vehicle'];

beforeEach(async () => {
  ({ answers, clock, socket, texts, tower, vehicle } = await signedInTower());
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
    const operation = { ...LANDS, state: 'done', words: 'Heron accepted, now changing to LAND.' };
    socket().says({ type: 'operation', operation });
    expect(await result).toEqual({ kind: 'reported', isDone: true, words: operation.words });
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
    expect(await result).toEqual({ kind: 'reported', isDone: false, words: 'Heron, changing to LAND: denied.' });
    expect(socket().sent).toEqual([]);
  });

  it('that the tower refuses are over, with its words', async () => {
    answers[COMMANDS] = [409, { title: 'No', detail: 'boss has the controls of Heron.' }];
    const result = await vehicle(1).command('Arm', { command: 'arm' });
    expect(result).toEqual({ kind: 'reported', isDone: false, problem: '', words: 'boss has the controls of Heron.' });
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

  it('ends when an admin takes control', async () => {
    const result = vehicle(1).sendHold();
    const boss = { id: 1, name: 'boss' };
    socket().says({ type: 'control', drone_id: 1, event: 'taken', epoch: 2, holder: boss, by: boss, reason: 'storm' });
    expect((await result).kind).toBe('failed');
    expect(texts()).toContain('boss TOOK control of Heron: storm');
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
    await clock.pass(CENTRED_MS + 60);
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
    await clock.pass(CENTRED_MS + 40);
    expect(manual.state.get().phase).toBe('flying');
    const before = socket().frames.length;
    const notice = { severity: 'warning', code: 'other-hands', text: 'Another window.', drone_id: 1, count: 1 };
    socket().says({ type: 'notice', ...notice });
    await clock.pass(200);
    expect(manual.state.get()).toMatchObject({
      phase: 'off',
      ended: 'it is flown from another window or program of yours',
    });
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

  it('reads the check before flight again when the tower says that it has changed, and after a reconnection', async () => {
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
    await clock.pass(CENTRED_MS + 100);
    expect(manual.state.get().phase).toBe('flying');
    socket().says({ type: 'hold', drone_id: 1, epoch: 2, step: 'ordered', detail: '', elapsed_ms: 0, cause: 'order' });
    await clock.pass(100);
    expect(manual.state.get()).toMatchObject({ phase: 'off' });
    expect(manual.state.get().ended).toContain('put on hold');
    expect(clock.waiting).toBeLessThan(5); // no stick stream continues
  });

  it('remembers since when a drone is silent, and whether it was in the air', async () => {
    socket().says({ type: 'drone', drone: { ...mine, airborne: true, epoch: 2 } });
    await clock.pass(500);
    const atMs = clock.nowMs();
    socket().says({ type: 'drone', drone: { ...mine, airborne: null, online: false, epoch: 2 } });
    expect(vehicle(1)).toMatchObject({ silentSinceMs: atMs, wasAirborne: true });
    // Back, but its autopilot is silent: the last known state stays.
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
