import { describe, expect, it } from 'vitest';

import { holderAt, holderSpans, marksOf, silentSpans, stickHandAt, type IndexEntry } from '../../src/replay/marks';
import { fetchFlight, RANGE_BYTES } from '../../src/replay/flight_fetch';
import { nextSpeed, replayKey } from '../../src/replay/replay_keys';
import { thumbnail } from '../../src/replay/thumbnail';
import { inStep } from '../../src/replay/video_step';
import { playedTenths, playedTime } from '../../src/words/replay_words';

const at = (seconds: number, kind: string, about: Record<string, unknown> = {}): IndexEntry => ({
  at_us: seconds * 1e6,
  kind,
  ...about,
});
const alice = { id: 1, name: 'alice' };
const admin = { id: 2, name: 'admin' };
const TAKE_OFF = { work: 'command', about: { command: 'takeoff', height_m: 15 }, by: alice, way: 'operation' };
const INDEX = [
  at(10, 'armed', { holder: alice }),
  at(11, 'command', { operation: 'a', ...TAKE_OFF, state: 'running', answer: '' }),
  at(12, 'command', { operation: 'a', ...TAKE_OFF, state: 'done', answer: 'accepted' }),
  at(13, 'command', { command: 'rtl', about: {}, by: alice, way: 'frames', count: 1, answer: 'accepted' }),
  at(14, 'command', { operation: 'b', work: 'plan_upload', about: {}, by: alice, state: 'failed', answer: 'no room' }),
  at(15, 'sticks', { by: alice }),
  at(20, 'control', { event: 'taken', holder: admin, by: admin, reason: 'airspace' }),
  at(20.1, 'hold', { step: 'ordered', cause: 'order', detail: 'taken' }),
  at(21, 'hold', { step: 'unconfirmed', detail: 'no answer' }),
  at(22, 'sticks_rest', { by: alice }),
  at(25, 'link_lost'),
  at(28, 'link_back'),
  at(29, 'something-new'),
  at(30, 'alert', { severity: 'critical', state: 'opened', words: 'Battery empty' }),
  at(40, 'disarmed'),
];

describe('the index of a flight', () => {
  const marks = marksOf(INDEX, null, 'Heron');

  it('is told in order, each command once with its answer', () => {
    expect(marks.map(({ atMs, text }) => `${atMs / 1000} ${text}`)).toEqual([
      '10 Heron armed; alice has the controls',
      '11 alice: takeoff, height m: 15 (accepted)',
      '13 alice: rtl (accepted)',
      '14 alice: plan to the drone (no room)',
      '15 alice moves the sticks',
      '20 admin TOOK control of Heron: airspace',
      '20.1 Hold ordered (ordered by the tower: taken)',
      '21 Hold NOT CONFIRMED: no answer',
      '22 The sticks of alice rest',
      '25 Heron is not heard any more',
      '28 Heron is heard again',
      '30 Alert opened: Battery empty',
      '40 Heron disarmed',
    ]);
    expect(marks.filter(({ severity }) => severity === 'error').map(({ atMs }) => atMs / 1000)).toEqual([21, 25, 30]);
  });

  it('says who had the controls and the sticks when', () => {
    const spans = holderSpans(INDEX, 0, 50_000);
    expect(spans).toEqual([
      { fromMs: 10_000, toMs: 20_000, label: 'alice' },
      { fromMs: 20_000, toMs: 50_000, label: 'admin' },
    ]);
    expect([5, 15, 20, 49].map((second) => holderAt(spans, second * 1000))).toEqual(['', 'alice', 'admin', 'admin']);
    expect([14, 16, 23].map((second) => stickHandAt(INDEX, second * 1000))).toEqual(['', 'alice', '']);
    expect(silentSpans(INDEX, 50_000)).toEqual([{ fromMs: 25_000, toMs: 28_000, label: 'Not heard' }]);
  });
});

describe('fetching', () => {
  const whole = new Uint8Array(RANGE_BYTES * 2 + 100).map((_, index) => index % 251);
  const answer = (header: string): Response => {
    const [, from, to] = /bytes=(\d+)-(\d+)/.exec(header)!;
    const piece = whole.slice(Number(from), Number(to) + 1);
    const range = `bytes ${from}-${Number(from) + piece.length - 1}/${whole.length}`;
    return new Response(piece, { status: 206, headers: { 'Content-Range': range } });
  };

  it('goes by ranges, and repeats one that broke', async () => {
    const asked: string[] = [];
    const got: number[] = [];
    await fetchFlight(
      '/x',
      (piece, total) => {
        got.push(...piece.subarray(0, 1), piece.length);
        expect(total).toBe(whole.length);
      },
      (_, { headers }) => {
        asked.push(headers['Range']!);
        return asked.length === 2 ? Promise.reject(new Error('broken')) : Promise.resolve(answer(headers['Range']!));
      },
      () => Promise.resolve(),
    );
    expect(asked).toHaveLength(4);
    expect(asked[1]).toBe(asked[2]);
    expect(got.filter((_, index) => index % 2 === 1)).toEqual([RANGE_BYTES, RANGE_BYTES, 100]);
  });

  it('says at once that there is no such flight', async () => {
    const refused = fetchFlight(
      '/x',
      () => undefined,
      () => Promise.resolve(new Response(null, { status: 404 })),
    );
    await expect(refused).rejects.toThrow('no such flight');
  });
});

describe('keys', () => {
  const key = (name: string, shiftKey = false) =>
    replayKey({ key: name, shiftKey, ctrlKey: false, metaKey: false, altKey: false });

  it('move, play, and change the speed', () => {
    expect(key(' ')).toEqual({ do: 'toggle' });
    expect(key('ArrowLeft')).toEqual({ do: 'by', ms: -5_000 });
    expect(key('ArrowRight', true)).toEqual({ do: 'by', ms: 30_000 });
    expect([key(','), key('.')]).toEqual([
      { do: 'by', ms: -100 },
      { do: 'by', ms: 100 },
    ]);
    expect([key('Home'), key('End')]).toEqual([
      { do: 'to', end: 'begin' },
      { do: 'to', end: 'end' },
    ]);
    expect(key('h')).toBeNull(); // Hold, on every page
    expect([nextSpeed(1, 1), nextSpeed(16, 1), nextSpeed(0.25, -1)]).toEqual([2, 16, 0.25]);
  });
});

describe('a video', () => {
  it('is set anew when far apart, catches up when near, and is left alone in step', () => {
    expect(inStep(10, 20, 1, true)).toEqual({ setS: 10, rate: 1 });
    expect(inStep(10.09, 10, 1, true)).toEqual({ setS: null, rate: 1.25 });
    expect(inStep(10.2, 10, 1, true)).toEqual({ setS: null, rate: 1.5 });
    expect(inStep(10, 10.45, 1, true)).toEqual({ setS: null, rate: 0.25 });
    expect(inStep(10, 10.2, 4, true)).toEqual({ setS: null, rate: 3 });
    expect(inStep(10.01, 10, 2, true)).toEqual({ setS: null, rate: 2 });
    expect(inStep(10.1, 10, 1, false)).toEqual({ setS: 10.1, rate: 1 });
    expect(inStep(10.2, 10, 16, true).rate).toBe(16);
  });
});

it('times of a replay', () => {
  expect([playedTime(61_000), playedTime(3_661_000), playedTenths(61_950)]).toEqual(['01:01', '1:01:01', '01:01.9']);
});

describe('the picture of a way', () => {
  it('fits, keeps its shape, and crosses the date line', () => {
    const square = thumbnail(
      [
        [0, 179.999],
        [0.001, 179.999],
        [0.001, -179.999],
      ],
      64,
      44,
    )!;
    expect(square.path).toBe('M4 36L4 8L60 8');
    expect(thumbnail([[47, 8]], 64, 44)).toBeNull();
    const still = thumbnail(
      [
        [47, 8],
        [47.00001, 8],
      ],
      64,
      44,
    )!;
    expect(Math.abs(still.begin[1] - still.end[1])).toBeLessThan(3); // a metre is not drawn as a journey
  });
});
