import { beforeEach, describe, expect, it } from 'vitest';

import { VideoSession, type PlayerPort } from '../../src/video/video_session';
import type { FromPlayer, ToPlayer, VideoStatus } from '../../src/video/video_types';
import { FakeClock } from '../link/fakes';

class FakePlayer implements PlayerPort {
  onmessage: ((event: { data: FromPlayer }) => void) | null = null;
  readonly heard: ToPlayer[] = [];
  readonly given: unknown[] = [];
  isOver = false;

  postMessage(message: ToPlayer, transfer: Transferable[] = []): void {
    this.heard.push(message);
    this.given.push(...transfer);
  }

  terminate(): void {
    this.isOver = true;
  }

  says(data: FromPlayer): void {
    this.onmessage?.({ data });
  }
}

const canvas = {} as OffscreenCanvas;
const STATUS: VideoStatus = {
  state: 'live',
  words: '',
  codecs: ['mpeg1'],
  quality: 'low',
  codec: 'mpeg1',
  sinceMs: 0,
  retryAtMs: null,
};
let clock: FakeClock;
let player: FakePlayer;
let deaths: number;
let session: VideoSession;

beforeEach(() => {
  clock = new FakeClock();
  player = new FakePlayer();
  deaths = 0;
  session = new VideoSession({
    clock,
    player,
    canvas,
    page: { protocol: 'https:', host: 'tower.example' },
    droneId: 3,
    quality: 'low',
    codec: 'auto',
    onDead: () => (deaths += 1),
  });
});

describe("the page's end of a video", () => {
  it('gives the canvas away, and asks', () => {
    expect(player.heard).toEqual([
      {
        type: 'open',
        canvas,
        page: { protocol: 'https:', host: 'tower.example' },
        droneId: 3,
        quality: 'low',
        codec: 'auto',
      },
    ]);
    expect(player.given).toEqual([canvas]);
    expect(session.status.get()).toMatchObject({ state: 'connecting', quality: 'low' });
  });

  it('hears how it goes', () => {
    player.says({ type: 'status', status: STATUS });
    expect(session.status.get()).toBe(STATUS);
    expect(session.stats.get()).toBeNull();
  });

  it('pauses once and goes on once', () => {
    session.watch(true);
    session.watch(false);
    session.watch(false);
    session.watch(true);
    expect(player.heard.slice(1)).toEqual([
      { type: 'watch', isWatched: false },
      { type: 'watch', isWatched: true },
    ]);
  });

  it('gets each snapshot that was asked for, and none when it stops', async () => {
    const [first, second, third] = [session.snapshot(), session.snapshot(), session.snapshot()];
    const picture = new Blob(['png']);
    player.says({ type: 'snapshot', key: 2, picture: null });
    player.says({ type: 'snapshot', key: 1, picture });
    expect(await first).toBe(picture);
    expect(await second).toBeNull();
    session.stop();
    expect(await third).toBeNull();
    expect(player.heard.at(-1)).toEqual({ type: 'stop' });
    expect(player.isOver).toBe(true);
    expect(clock.waiting).toBe(0);
  });

  it('takes a player that says nothing any more for dead', async () => {
    await clock.pass(7_000);
    player.says({ type: 'status', status: STATUS });
    await clock.pass(7_000);
    expect(deaths).toBe(0);
    await clock.pass(1_000);
    expect(deaths).toBe(1);
    expect(player.isOver).toBe(true);
    await clock.pass(60_000);
    expect(deaths).toBe(1);
  });

  it('does not wait for one that is paused, or cannot play at all', async () => {
    session.watch(false);
    await clock.pass(60_000);
    session.watch(true);
    player.says({ type: 'status', status: { ...STATUS, state: 'unplayable' } });
    await clock.pass(60_000);
    expect(deaths).toBe(0);
  });
});
