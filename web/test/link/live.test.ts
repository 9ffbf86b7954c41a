import { beforeEach, describe, expect, it } from 'vitest';

import { Live, liveUrl } from '../../src/link/live';
import type { TowerEvent } from '../../src/link/wire_types';
import { FakeClock, FakeSocket } from './fakes';

const WELCOME = { type: 'welcome', user: { id: 1, name: 'a', role: 'admin' }, drones: [], server_time: '' };

let clock: FakeClock;
let sockets: FakeSocket[];
let events: TowerEvent[];
let frames: Uint8Array[];
let live: Live;
const last = (): FakeSocket => sockets.at(-1)!;
const phase = (): string => live.state.get().phase;

beforeEach(() => {
  clock = new FakeClock();
  sockets = [];
  events = [];
  frames = [];
  live = new Live({
    clock,
    openSocket: () => {
      const socket = new FakeSocket();
      sockets.push(socket);
      return socket;
    },
    onEvent: (event) => events.push(event),
    onFrames: (message) => frames.push(message),
    random: () => 1,
  });
});

describe('the live connection', () => {
  it('takes its address from the page', () => {
    expect(liveUrl({ protocol: 'https:', host: 'tower.example:8443' })).toBe('wss://tower.example:8443/api/v1/live');
    expect(liveUrl({ protocol: 'http:', host: '127.0.0.1:8000' })).toBe('ws://127.0.0.1:8000/api/v1/live');
  });

  it('is open only after the welcome, and then issues its subscriptions', () => {
    live.watch(5);
    live.focus(3);
    live.start();
    expect(phase()).toBe('connecting');
    expect(last().sent).toEqual([]);
    last().says(WELCOME);
    expect(phase()).toBe('open');
    expect(last().sent).toEqual(['{"type":"watch","rate_hz":5}', '{"type":"focus","drone_id":3}']);
  });

  it('issues the subscriptions again after a reconnection', async () => {
    live.watch(2);
    live.start();
    last().says(WELCOME);
    live.focus(9);
    last().onclose?.({ code: 1006 });
    expect(phase()).toBe('waiting');
    await clock.pass(500);
    expect(sockets).toHaveLength(2);
    last().says(WELCOME);
    expect(last().sent).toEqual(['{"type":"watch","rate_hz":2}', '{"type":"focus","drone_id":9}']);
  });

  it('says what the map shows, only when it has changed, and again after each reconnection', async () => {
    live.start();
    live.viewport({ south: 10, west: 20, north: 20, east: 40 });
    last().says(WELCOME);
    const said = '{"type":"viewport","bounds":{"south":8,"west":16,"north":22,"east":44}}';
    expect(last().sent).toEqual([said]);
    live.viewport({ south: 10, west: 20, north: 20, east: 40 });
    expect(last().sent).toHaveLength(1);
    last().onclose?.({ code: 1006 });
    await clock.pass(500);
    last().says(WELCOME);
    expect(last().sent).toEqual([said]);
    live.viewport(null);
    expect(last().sent.at(-1)).toBe('{"type":"viewport","bounds":null}');
  });

  it('waits longer after each failure, up to a bound, and says until when', async () => {
    live.start();
    const waits: number[] = [];
    for (let round = 0; round < 7; round++) {
      last().onclose?.({ code: 1006 });
      const wait = live.state.get().retryAtMs! - clock.nowMs();
      waits.push(wait);
      await clock.pass(wait);
    }
    expect(waits).toEqual([500, 1000, 2000, 4000, 8000, 8000, 8000]);
    last().says(WELCOME);
    expect(live.state.get()).toEqual({ phase: 'open', failures: 0, retryAtMs: null, why: '' });
  });

  it('stops when the tower says that we are not signed in', async () => {
    live.start();
    last().onclose?.({ code: 4401 });
    await clock.pass(60_000);
    expect(phase()).toBe('signed-out');
    expect(sockets).toHaveLength(1);
    live.start();
    expect(phase()).toBe('connecting');
  });

  it('goes on after a wrong origin or a shutdown', () => {
    for (const code of [4403, 4400, 1001]) {
      live.stop();
      live.start();
      last().onclose?.({ code });
      expect(phase()).toBe('waiting');
    }
  });

  it('sends nothing, and keeps nothing, while it is down', async () => {
    live.start();
    expect(live.send(new Uint8Array([1]))).toBe(false);
    last().onclose?.({ code: 1006 });
    expect(live.send(new Uint8Array([2]))).toBe(false);
    await clock.pass(500);
    last().says(WELCOME);
    expect(last().sent).toEqual([]);
    expect(live.send(new Uint8Array([3]))).toBe(true);
    expect(last().frames).toEqual([new Uint8Array([3])]);
  });

  it('begins each binary message with a stamp: tag 0 and its clock', async () => {
    live.start();
    last().says(WELCOME);
    await clock.pass(0x1_0000);
    live.send(new Uint8Array([7, 8]));
    // 0x10000 later than 1000 ms, without the fraction
    expect(last().sent).toEqual([new Uint8Array([0, 0, 0, 0, 0xe8, 3, 1, 0, 7, 8])]);
  });

  it('answers a ping at once and tells nobody', () => {
    live.start();
    last().says({ type: 'ping', sequence: 1 });
    expect(last().sent).toEqual([]);
    last().says(WELCOME);
    last().says({ type: 'ping', sequence: 41 });
    expect(last().texts).toEqual([{ type: 'pong', sequence: 41 }]);
    expect(events.map(({ type }) => type)).toEqual(['welcome']);
  });

  it('leaves out what would have to wait', () => {
    live.start();
    expect(live.sendFresh(new Uint8Array([1]))).toBe('down');
    last().says(WELCOME);
    expect(live.sendFresh(new Uint8Array([2]))).toBe('sent');
    last().bufferedAmount = 4_000;
    expect(live.sendFresh(new Uint8Array([3]))).toBe('skipped');
    last().bufferedAmount = 0;
    expect(live.sendFresh(new Uint8Array([4]))).toBe('sent');
    expect(last().frames).toEqual([new Uint8Array([2]), new Uint8Array([4])]);
  });

  it('notices a dead socket sooner while the tower pings', async () => {
    live.start();
    last().says(WELCOME);
    live.expectTraffic(true);
    last().says({ type: 'ping', sequence: 1 });
    const heardAtMs = clock.nowMs();
    await clock.pass(2_900);
    expect(phase()).toBe('open');
    await clock.pass(200);
    expect(phase()).not.toBe('open');
    expect(live.heardAtMs).toBe(heardAtMs);
  });

  it('takes silence for a dead socket only when there should be traffic', async () => {
    live.start();
    last().says(WELCOME);
    await clock.pass(60_000);
    expect(phase()).toBe('open');
    live.expectTraffic(true);
    await clock.pass(5_000);
    last().saysBytes(new Uint8Array(3));
    await clock.pass(5_000);
    expect(phase()).toBe('open');
    await clock.pass(1_500);
    expect(phase()).not.toBe('open');
    expect(sockets[0]!.closed).toBe(true);
  });

  it('gives up on a tower that takes the connection and never welcomes', async () => {
    live.start();
    await clock.pass(10_000);
    expect(phase()).toBe('waiting');
  });

  it('ignores what it does not understand', () => {
    live.start();
    last().says(WELCOME);
    last().says({ type: 'tomorrow' });
    last().onmessage?.({ data: 'not json' });
    last().onmessage?.({ data: '17' });
    expect(events.map(({ type }) => type)).toEqual(['welcome']);
  });

  it('leaves nothing behind when stopped', async () => {
    live.start();
    const socket = last();
    live.stop();
    expect(socket.closed).toBe(true);
    expect(clock.waiting).toBe(0);
    await clock.pass(60_000);
    expect(sockets).toHaveLength(1);
  });

  it('retries at once when the network is back', () => {
    live.start();
    last().onclose?.({ code: 1006 });
    live.retryNow();
    expect(sockets).toHaveLength(2);
    expect(phase()).toBe('connecting');
  });
});

describe('with several towers', () => {
  const WITH_OTHERS = { ...WELCOME, other_towers: true };

  beforeEach(() => {
    live.start();
    live.watch(5);
    last().says(WITH_OTHERS);
  });

  it('leaves its tower only when another one has welcomed it', async () => {
    const former = last();
    former.says({ type: 'leave_tower' });
    expect(sockets).toHaveLength(2);
    expect(live.send(new Uint8Array([1]))).toBe(true);
    expect(former.sent).toHaveLength(2);
    former.says({ type: 'leave_tower' });
    expect(sockets).toHaveLength(2);
    last().says(WITH_OTHERS);
    expect(phase()).toBe('open');
    expect(former.closed).toBe(true);
    expect(last().sent).toEqual(['{"type":"watch","rate_hz":5}']);
    expect(live.send(new Uint8Array([1]))).toBe(true);
    expect(last().sent).toHaveLength(2);
    expect(events.map(({ type }) => type)).toEqual(['welcome', 'welcome']);
    await clock.pass(2_000);
    expect(phase()).toBe('open');
  });

  it('stays where it is when no other tower takes it, and tries again when told again', async () => {
    const former = last();
    former.says({ type: 'leave_tower' });
    last().onclose?.({ code: 1013 });
    expect(former.closed).toBe(false);
    former.says({ type: 'leave_tower' });
    await clock.pass(2_000);
    expect(last().closed).toBe(true);
    expect([phase(), former.closed]).toEqual(['open', false]);
  });

  it('takes a shorter silence for a dead tower, and connects again at once', async () => {
    live.expectTraffic(true);
    last().says({ type: 'ping', sequence: 1 });
    await clock.pass(1_499);
    expect(phase()).toBe('open');
    await clock.pass(1);
    expect(phase()).toBe('waiting');
    await clock.pass(200);
    expect(phase()).toBe('connecting');
    await clock.pass(2_000);
    expect(phase()).toBe('waiting');
  });
});
