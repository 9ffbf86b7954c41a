import { describe, expect, it } from 'vitest';

import { PictureStats } from '../../src/video/picture_stats';

describe('the figures of a video', () => {
  it('know nothing at first', () => {
    expect(new PictureStats(0).report(500, 0)).toEqual({
      delayMs: null,
      worstDelayMs: null,
      stillMs: null,
      rateHz: 0,
      bitsPerS: 0,
      lost: 0,
      skipped: 0,
      decodeMs: null,
      width: 0,
      height: 0,
    });
  });

  it('are rates of the last two seconds, and delays since the last report', () => {
    const stats = new PictureStats(0);
    for (let at = 40; at <= 10_000; at += 40) {
      stats.came(at, 1000);
      stats.decoded(2);
      stats.drawn(at, at <= 9_000 ? 400 : 80 + (at % 120 === 0 ? 40 : 0), 320, 240);
      if (at === 9_000) stats.report(at, 0);
    }
    const report = stats.report(10_000, 0);
    expect(report.rateHz).toBeCloseTo(25, 5);
    expect(report.bitsPerS).toBeCloseTo(200_000, 0);
    expect(report).toMatchObject({ delayMs: 80, worstDelayMs: 120, stillMs: 0, decodeMs: 2, width: 320, height: 240 });
  });

  it('are right from the beginning', () => {
    const stats = new PictureStats(0);
    for (let at = 40; at <= 400; at += 40) stats.drawn(at, null, 4, 3);
    expect(stats.report(400, 0).rateHz).toBeCloseTo(25, 5);
  });

  it('say how long nothing new came, with the delay that the last picture had', () => {
    const stats = new PictureStats(0);
    stats.drawn(100, 55, 4, 3);
    stats.report(500, 0);
    expect(stats.report(3_100, 0)).toMatchObject({ stillMs: 3_000, delayMs: 55, rateHz: 0 });
    stats.drawn(3_200, null, 4, 3);
    expect(stats.report(3_300, 0).delayMs).toBeNull();
  });

  it('tell what was lost from what the tower left out', () => {
    const stats = new PictureStats(0);
    stats.skipped = 5;
    expect(stats.report(1, 7)).toMatchObject({ lost: 2, skipped: 5 });
    expect(stats.report(1, 3)).toMatchObject({ lost: 0, skipped: 5 });
  });

  it('begin again with another connection, and keep what was lost', () => {
    const stats = new PictureStats(0);
    stats.skipped = 1;
    stats.came(100, 5000);
    stats.drawn(100, 55, 4, 3);
    stats.restart(1_000);
    expect(stats.report(1_500, 0)).toMatchObject({ rateHz: 0, bitsPerS: 0, skipped: 1, stillMs: 1_400 });
  });
});
