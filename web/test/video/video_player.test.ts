import { beforeEach, describe, expect, it } from 'vitest';

import type { Planes } from '../../src/video/screen';
import type { Unit } from '../../src/video/unit';
import type { StreamRequest } from '../../src/video/video_link';
import { VideoPlayer, type VideoPlayerOptions } from '../../src/video/video_player';
import type { FromPlayer, VideoStats, VideoStatus } from '../../src/video/video_types';
import { FakeClock, FakeSocket } from '../link/fakes';
import { goldenUnits } from './golden_units';

const PLANES: Planes = {
  width: 120,
  height: 68,
  codedWidth: 128,
  codedHeight: 80,
  y: new Uint8Array(1),
  cb: new Uint8Array(1),
  cr: new Uint8Array(1),
};
const state = (more: object = {}): object => ({ type: 'state', state: 'live', words: '', codecs: ['mpeg1'], ...more });

class FakeFrame {
  closed = false;
  readonly number: number;
  constructor(number: number) {
    this.number = number;
  }
  close(): void {
    this.closed = true;
  }
}

let clock: FakeClock;
let sockets: FakeSocket[];
let wishes: StreamRequest[];
let reported: FromPlayer[];
let turns: (() => void)[];
let drawn: string[];
let decoded: number;
let isDecoderBroken: boolean;
let inside: Unit[];
let frames: FakeFrame[];
let give: (picture: VideoFrame, unit: Unit) => void;
let fault: (words: string) => void;
let player: VideoPlayer;

const last = (): FakeSocket => sockets.at(-1)!;
const status = (): VideoStatus => reported.findLast((one) => one.type === 'status')!.status;
const stats = (): VideoStats => reported.findLast((one) => one.type === 'stats')!.stats;
const said = (type: string): object[] =>
  last().texts.filter((one) => (one as { type: string }).type === type) as object[];
const takeTurns = (): void => turns.splice(0).forEach((turn) => turn());

function send(stream: 'mpeg1' | 'h264', ...numbers: number[]): void {
  const units = goldenUnits(stream);
  for (const number of numbers) last().saysBytes(new Uint8Array(units[number]!.message));
}

/** The browser's decoder outputs everything that it received. */
function giveAll(): void {
  for (const unit of inside.splice(0)) {
    const frame = new FakeFrame(unit.sequence);
    frames.push(frame);
    give(frame as unknown as VideoFrame, unit);
  }
}

function open(more: Partial<VideoPlayerOptions> = {}): void {
  player = new VideoPlayer({
    clock,
    quality: 'medium',
    codec: 'auto',
    screen: {
      planes: () => drawn.push('planes'),
      frame: (frame) => drawn.push(`frame ${(frame as unknown as FakeFrame).number}`),
      again: () => drawn.push('again'),
    },
    mpeg1: {
      decode: () => {
        decoded += 1;
        return isDecoderBroken ? null : PLANES;
      },
    },
    openH264: (onPicture, onFault) => {
      give = onPicture;
      fault = onFault;
      return { decode: (unit) => inside.push(unit), close: () => undefined };
    },
    openSocket: (request) => {
      wishes.push(request);
      sockets.push(new FakeSocket());
      return last();
    },
    emit: (message) => reported.push(message),
    afterWaiting: (turn) => turns.push(turn),
    ...more,
  });
}

beforeEach(() => {
  clock = new FakeClock();
  [sockets, reported, turns, drawn, decoded, isDecoderBroken, inside, frames] = [[], [], [], [], 0, false, [], []];
  wishes = [];
});

describe('what is asked for at first', () => {
  it('is both where the browser can, the better one first, and what the drone has is known to the tower alone', () => {
    open();
    open({ codec: 'mpeg1' });
    open({ codec: 'h264' });
    open({ openH264: null });
    expect(wishes).toEqual([
      { quality: 'medium', codec: 'mpeg1', rather: 'h264' },
      { quality: 'medium', codec: 'mpeg1' },
      { quality: 'medium', codec: 'h264' },
      { quality: 'medium', codec: 'mpeg1' },
    ]);
  });
});

describe('a picture', () => {
  it('is decoded when it comes, drawn right after, and the tower told', () => {
    open();
    last().says(state());
    send('mpeg1', 0);
    expect([decoded, drawn]).toEqual([1, []]);
    takeTurns();
    expect(drawn).toEqual(['planes']);
    expect(said('got')).toEqual([{ type: 'got', sequence: 2 ** 32 - 3 }]);
  });

  it('of several that wait the newest is drawn, and all are decoded', () => {
    open();
    last().says(state());
    send('mpeg1', 0, 1, 2, 3);
    takeTurns();
    expect([decoded, drawn]).toEqual([4, ['planes']]);
    expect(said('got')).toEqual([{ type: 'got', sequence: 0 }]); // the fourth: the count has wrapped
    send('mpeg1', 4);
    takeTurns();
    expect(drawn).toHaveLength(2);
  });

  it('after a gap is neither decoded nor drawn before the next key picture, and yet told as got', () => {
    open();
    last().says(state());
    send('mpeg1', 0, 2, 3);
    expect(decoded).toBe(1);
    send('mpeg1', 6);
    expect(decoded).toBe(2);
    send('mpeg1', 1);
    takeTurns();
    expect(decoded).toBe(2);
    expect(said('got')).toEqual([{ type: 'got', sequence: 2 ** 32 - 2 }]);
  });

  it('that cannot be decoded ends what hangs on it', () => {
    open();
    last().says(state());
    isDecoderBroken = true;
    send('mpeg1', 0, 1);
    isDecoderBroken = false;
    send('mpeg1', 2);
    takeTurns();
    expect([decoded, drawn]).toEqual([1, []]);
    send('mpeg1', 6);
    takeTurns();
    expect(drawn).toEqual(['planes']);
  });

  it('is as old as the clocks say', async () => {
    open();
    last().says(state());
    const nowMs = clock.monotonicMs();
    last().says({ type: 'clock', sent: nowMs, tower_us: 1_000_000 + 70_000 }); // it was taken 70 ms ago
    send('mpeg1', 0);
    takeTurns();
    await clock.pass(500);
    expect(stats()).toMatchObject({ delayMs: 70, stillMs: 500, width: 120, height: 68, lost: 0 });
  });

  it('is reported when the first one is drawn, not half a second later', () => {
    open();
    last().says(state());
    send('mpeg1', 0);
    expect(stats().stillMs).toBeNull();
    takeTurns();
    expect(stats().stillMs).toBe(0);
  });

  it('can be drawn again to be saved, once there is one', () => {
    open();
    expect(player.drawAgain()).toBe(false);
    last().says(state());
    send('mpeg1', 0);
    takeTurns();
    expect(player.drawAgain()).toBe(true);
    expect(drawn).toEqual(['planes', 'again']);
  });
});

describe('H.264', () => {
  beforeEach(() => {
    open();
    last().says(state({ codecs: ['mpeg1', 'h264'] }));
  });

  it('is asked for where agent and browser have it', () => {
    expect(said('want')).toEqual([{ type: 'want', quality: 'medium', codec: 'h264' }]);
    expect(status()).toMatchObject({ state: 'live', codec: 'h264', codecs: ['mpeg1', 'h264'] });
  });

  it('draws the newest frame and gives all back to the browser', () => {
    send('h264', 0, 1, 2);
    expect(said('got')).toEqual([]);
    giveAll();
    takeTurns();
    expect(said('got')).toEqual([{ type: 'got', sequence: 2 }]);
    expect(drawn).toEqual(['frame 2']);
    expect(frames.map((frame) => frame.closed)).toEqual([true, true, true]);
  });

  it('waits for a key picture after a fault, and gives up after three', () => {
    for (let round = 1; round <= 3; round++) {
      send('h264', 0, 1);
      expect(inside.splice(0)).toHaveLength(2);
      fault('the decoder is gone');
      send('h264', 2);
      expect(inside).toHaveLength(0);
    }
    expect(said('want')).toEqual([
      { type: 'want', quality: 'medium', codec: 'h264' },
      { type: 'want', quality: 'medium', codec: 'mpeg1' },
    ]);
  });

  it('keeps no frame when it stops', () => {
    send('h264', 0);
    giveAll();
    player.stop();
    takeTurns();
    expect(frames[0]!.closed).toBe(true);
    expect(drawn).toEqual([]);
    expect(clock.waiting).toBe(0);
  });

  it('is not asked for when MPEG-1 is', () => {
    player.want('high', 'mpeg1');
    expect(said('want').at(-1)).toEqual({ type: 'want', quality: 'high', codec: 'mpeg1' });
  });
});

describe('without H.264 in the browser', () => {
  it('is MPEG-1, whatever is asked for', () => {
    open({ openH264: null, codec: 'h264' });
    last().says(state({ codecs: ['mpeg1', 'h264'] }));
    expect(said('want')).toEqual([]);
    expect(status().codec).toBe('mpeg1');
  });
});

describe('the state', () => {
  it('is what the tower says while it can be heard, and since when', async () => {
    open();
    expect(status().state).toBe('connecting');
    last().says(state({ state: 'camera-lost', words: 'USB is gone' }));
    const sinceMs = clock.nowMs();
    expect(status()).toMatchObject({ state: 'camera-lost', words: 'USB is gone', sinceMs });
    await clock.pass(2_000);
    last().says(state({ state: 'camera-lost', words: 'still gone' }));
    expect(status()).toMatchObject({ words: 'still gone', sinceMs });
    last().onclose?.({ code: 1006 });
    expect(status()).toMatchObject({ state: 'cut-off', words: '', sinceMs: clock.nowMs() });
    expect(status().retryAtMs).toBeGreaterThan(clock.nowMs());
    await clock.pass(1_000);
    last().onclose?.({ code: 4403, reason: 'the view was taken' });
    expect(status()).toMatchObject({ state: 'refused', words: 'the view was taken' });
  });

  it('is paused while nobody looks, and nothing is asked for', () => {
    open();
    last().says(state());
    player.watch(false);
    expect(status().state).toBe('paused');
    expect(last().closed).toBe(true);
    player.watch(true);
    expect(sockets).toHaveLength(2);
    expect(status().state).toBe('connecting');
  });

  it('is told with its figures twice a second', async () => {
    open();
    reported.length = 0;
    await clock.pass(2_000);
    expect(reported.filter((one) => one.type === 'stats')).toHaveLength(4);
  });
});
