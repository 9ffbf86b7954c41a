import { describe, expect, it } from 'vitest';

import { TowerClock } from '../../src/video/tower_clock';

const OFFSET_MS = 5_000_000;

/** A request at `sentMs`; it takes `thereMs`, the response `backMs`. */
function ask(clock: TowerClock, sentMs: number, thereMs: number, backMs: number, offsetMs = OFFSET_MS): void {
  clock.answered(sentMs, sentMs + thereMs + backMs, (sentMs + thereMs + offsetMs) * 1000);
}

const errorMs = (clock: TowerClock, nowMs: number, offsetMs = OFFSET_MS): number =>
  clock.ageMs((nowMs + offsetMs) * 1000, nowMs)!;

describe('the clock of the tower', () => {
  it('is not known before the first answer, nor after a new beginning', () => {
    const clock = new TowerClock();
    expect(clock.ageMs(1, 1)).toBeNull();
    ask(clock, 100, 10, 10);
    expect(errorMs(clock, 200)).toBeCloseTo(0, 6);
    expect(clock.roundTripMs).toBe(20);
    clock.forget();
    expect(clock.ageMs(1, 1)).toBeNull();
    expect(clock.roundTripMs).toBeNull();
  });

  it('is told by the fastest answer, not by those that waited behind pictures', () => {
    const clock = new TowerClock();
    ask(clock, 0, 20, 300);
    ask(clock, 1000, 21, 22);
    for (let at = 2; at < 20; at++) ask(clock, at * 1000, 20, 100 + at * 13);
    expect(Math.abs(errorMs(clock, 20_000))).toBeLessThan(1);
  });

  it('follows a clock that runs otherwise: what is old counts no more', () => {
    const clock = new TowerClock();
    const drift = (atMs: number): number => OFFSET_MS + atMs * 0.000_1; // 100 millionths: a bad crystal
    for (let atMs = 0; atMs < 600_000; atMs += 2_000) ask(clock, atMs, 10, 10 + ((atMs / 2000) % 5), drift(atMs));
    expect(Math.abs(errorMs(clock, 600_000, drift(600_000)))).toBeLessThan(4);
  });

  it('takes no answer from before its question', () => {
    const clock = new TowerClock();
    clock.answered(500, 400, 1);
    clock.answered(Number.NaN, 400, 1);
    clock.answered(1, 2, Number.POSITIVE_INFINITY);
    expect(clock.ageMs(1, 1)).toBeNull();
  });
});
