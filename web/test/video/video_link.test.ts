import { beforeEach, describe, expect, it } from 'vitest';

import type { Done } from '../../src/video/got_cadence';
import type { Unit } from '../../src/video/unit';
import { VideoLink, videoUrl, type LinkState, type TowerSays, type StreamRequest } from '../../src/video/video_link';
import { FakeClock, FakeSocket } from '../link/fakes';
import { goldenUnits } from './golden_units';

const LIVE = { type: 'state', state: 'live', words: '', codecs: ['mpeg1', 'h264'], quality: 'medium', codec: 'mpeg1' };

let clock: FakeClock;
let sockets: FakeSocket[];
let wishes: StreamRequest[];
let states: LinkState[];
let reported: TowerSays[];
let units: Unit[];
let skipped: number;
let link: VideoLink;
const last = (): FakeSocket => sockets.at(-1)!;
const done = (sequence: number): Done => ({ sequence, captureUs: null, rateHz: 30 });
const phase = (): string => states.at(-1)!.phase;

beforeEach(() => {
  clock = new FakeClock();
  [sockets, wishes, states, reported, units, skipped] = [[], [], [], [], [], 0];
  link = new VideoLink(
    { quality: 'medium', codec: 'mpeg1' },
    {
      clock,
      openSocket: (request) => {
        wishes.push(request);
        sockets.push(new FakeSocket());
        return last();
      },
      onLink: (state) => states.push(state),
      onTower: (says) => reported.push(says),
      onUnit: (unit) => units.push(unit),
      onSkipped: (count) => (skipped += count),
      random: () => 1,
    },
  );
});

describe('the link of a video', () => {
  it('takes its address from the page and from what is wanted', () => {
    const request = { quality: 'low', codec: 'h264' } as const;
    expect(videoUrl({ protocol: 'https:', host: 'tower.example' }, 7, request)).toBe(
      'wss://tower.example/api/v1/drones/7/video?quality=low&codec=h264',
    );
    expect(
      videoUrl({ protocol: 'https:', host: 'tower.example' }, 7, { ...request, codec: 'mpeg1', rather: 'h264' }),
    ).toBe('wss://tower.example/api/v1/drones/7/video?quality=low&codec=h264,mpeg1');
    expect(videoUrl({ protocol: 'http:', host: '[::1]:80' }, 7, request)).toMatch(/^ws:\/\/\[::1\]:80\//);
  });

  it('is open by the first word of the tower, and hands on what it says', () => {
    link.start();
    expect(phase()).toBe('connecting');
    last().says({ ...LIVE, codecs: ['mpeg1', 'av1'] });
    expect(phase()).toBe('open');
    expect(reported).toEqual([{ state: 'live', words: '', codecs: ['mpeg1'] }]);
    last().says({ type: 'skipped', count: 4 });
    expect(skipped).toBe(4);
  });

  it('hands on units, and nothing that is none', () => {
    link.start();
    last().saysBytes(new Uint8Array(goldenUnits('mpeg1')[0]!.message));
    last().saysBytes(Uint8Array.of(1, 2, 3));
    last().onmessage?.({ data: 'no JSON' });
    last().onmessage?.({ data: 'null' });
    last().says({ type: 'state', state: 'singing' });
    last().says({ type: 'clock', sent: 'x' });
    expect(units.map((unit) => unit.sequence)).toEqual([2 ** 32 - 3]);
    expect(reported).toEqual([]);
  });

  it('asks for the time a few times at first, then now and then', async () => {
    link.start();
    const asked = (): number => last().texts.filter((one) => (one as { type: string }).type === 'clock').length;
    last().says(LIVE);
    expect(asked()).toBe(1);
    await clock.pass(400);
    expect(asked()).toBe(5);
    await clock.pass(4_000);
    expect(asked()).toBe(7);
    for (let second = 0; second < 20; second++) {
      last().saysBytes(new Uint8Array(goldenUnits('mpeg1')[0]!.message));
      await clock.pass(1_000);
    }
    expect(asked()).toBe(9);
    await clock.pass(3_000);
    expect(asked()).toBe(10);
    const sent = clock.monotonicMs() - 30;
    last().says({ type: 'clock', sent, tower_us: (sent + 15 + 800_000) * 1000 });
    expect(link.clock.ageMs(800_000_000, 0)).toBeCloseTo(0, 3);
    last().onclose?.({ code: 1006 });
    await clock.pass(500);
    expect(link.clock.roundTripMs).toBeNull();
  });

  it('says what came, and what else is wanted, only while it is open', () => {
    link.want({ quality: 'high', codec: 'mpeg1' });
    link.start();
    expect(wishes).toEqual([{ quality: 'high', codec: 'mpeg1' }]);
    link.got(done(1));
    link.want({ quality: 'low', codec: 'mpeg1' });
    expect(last().sent).toEqual([]);
    last().says(LIVE);
    link.got(done(2));
    link.want({ quality: 'low', codec: 'mpeg1' });
    link.want({ quality: 'low', codec: 'h264' });
    expect(last().texts.filter((one) => (one as { type: string }).type !== 'clock')).toEqual([
      { type: 'want', quality: 'low', codec: 'mpeg1' },
      { type: 'got', sequence: 2 },
      { type: 'want', quality: 'low', codec: 'h264' },
    ]);
  });

  it('says what came as the cadence has it, and nothing of it on the next connection', async () => {
    const gots = (): number[] =>
      last()
        .texts.filter((one) => (one as { type: string }).type === 'got')
        .map((one) => (one as { sequence: number }).sequence);
    link.start();
    last().says(LIVE);
    for (let sequence = 0; sequence < 7; sequence++) {
      link.got(done(sequence));
      await clock.pass(33);
    }
    expect(gots()).toEqual([0, 3, 6]);
    link.got(done(7));
    expect(gots()).toEqual([0, 3, 6]);
    await clock.pass(86);
    expect(gots()).toEqual([0, 3, 6]);
    await clock.pass(1);
    expect(gots()).toEqual([0, 3, 6, 7]);
    await clock.pass(75);
    link.got(done(8));
    link.got(done(9));
    expect(gots()).toEqual([0, 3, 6, 7, 8]);
    const closed = last();
    closed.onclose?.({ code: 1006 });
    await clock.pass(400);
    expect(closed.texts.at(-1)).toEqual({ type: 'got', sequence: 8 });
    await clock.pass(100);
    last().says(LIVE);
    link.got(done(0));
    expect(gots()).toEqual([0]);
  });

  it('comes back by itself, later and later, and asks for what was wanted last', async () => {
    link.start();
    last().says(LIVE);
    link.want({ quality: 'low', codec: 'mpeg1' });
    const waits: number[] = [];
    for (let round = 0; round < 6; round++) {
      last().onclose?.({ code: 1006 });
      expect(phase()).toBe('waiting');
      const waitMs = states.at(-1)!.retryAtMs! - clock.nowMs();
      waits.push(waitMs);
      await clock.pass(waitMs - 1);
      expect(sockets).toHaveLength(round + 1);
      await clock.pass(1);
      expect(sockets).toHaveLength(round + 2);
    }
    expect(waits).toEqual([500, 1000, 2000, 4000, 8000, 8000]);
    expect(wishes.at(-1)).toEqual({ quality: 'low', codec: 'mpeg1' });
    last().says(LIVE);
    expect(states.at(-1)).toMatchObject({ phase: 'open', failures: 0 });
  });

  it.each([
    [4401, 'sign in first'],
    [4403, 'the view was taken'],
    [4404, 'there is no such drone'],
    [4430, 'too many'],
  ])('takes %i for a no, and asks again without haste', async (code, reason) => {
    link.start();
    last().onclose?.({ code, reason });
    expect(states.at(-1)).toMatchObject({ phase: 'refused', why: reason });
    await clock.pass(4_999);
    expect(sockets).toHaveLength(1);
    await clock.pass(1);
    expect(sockets).toHaveLength(2);
  });

  it('takes a tower that says nothing any more for lost', async () => {
    link.start();
    last().says(LIVE);
    await clock.pass(5_000);
    last().says({ type: 'clock', sent: 1, tower_us: 1 });
    await clock.pass(5_999);
    expect(phase()).toBe('open');
    await clock.pass(1);
    expect(phase()).toBe('waiting');
    expect(last().closed).toBe(true);
  });

  it('stops: nothing is asked, nothing comes, nothing waits', async () => {
    link.start();
    last().says(LIVE);
    link.stop();
    link.got(done(1));
    expect(last().texts).toHaveLength(1);
    expect(last().onmessage).toBeNull();
    expect(clock.waiting).toBe(0);
    await clock.pass(60_000);
    expect(sockets).toHaveLength(1);
    link.start();
    expect(sockets).toHaveLength(2);
  });

  it('tries again when a socket cannot even be opened', async () => {
    let fails = 1;
    const opened: FakeSocket[] = [];
    const other = new VideoLink(link.request, {
      clock,
      openSocket: () => {
        if (fails-- > 0) throw new Error('no network');
        opened.push(new FakeSocket());
        return opened[0]!;
      },
      onLink: (state) => states.push(state),
      onTower: () => undefined,
      onUnit: () => undefined,
      onSkipped: () => undefined,
    });
    other.start();
    expect(phase()).toBe('waiting');
    await clock.pass(500);
    expect(opened).toHaveLength(1);
  });
});
