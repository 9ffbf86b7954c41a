import { beforeEach, describe, expect, it } from 'vitest';

import { GotCadence, type Got } from '../../src/video/got_cadence';

const RATE_HZ = 25;
const PICTURE_MS = 1000 / RATE_HZ;

let cadence: GotCadence;
let said: { atMs: number; got: Got }[];
let nowMs: number;
let sequence: number;

const hear = (got: Got | null): void => {
  if (got) said.push({ atMs: nowMs, got });
};

/** Advances the time, calling `look` whenever it is due. */
const until = (atMs: number): void => {
  while (cadence.lookAtMs <= atMs) {
    nowMs = Math.max(nowMs, cadence.lookAtMs);
    hear(cadence.look(nowMs));
  }
  nowMs = atMs;
};

/** Pictures that take 20 ms to arrive, plus `lateMs`. */
const draw = (count: number, { lateMs = 0, clockKnown = true } = {}): void => {
  for (let one = 0; one < count; one++) {
    const takenMs = sequence * PICTURE_MS;
    until(Math.max(nowMs, takenMs + 20 + lateMs));
    cadence.came(sequence, nowMs);
    hear(cadence.done({ sequence, captureUs: clockKnown ? takenMs * 1000 : null, rateHz: RATE_HZ }, nowMs));
    sequence += 1;
  }
};

const kinds = (): string[] => said.map(({ got }) => (got.calm ? 'calm' : got.overdue ? 'overdue' : 'drawn'));

beforeEach(() => {
  cadence = new GotCadence();
  [said, nowMs, sequence] = [[], 0, 0];
});

describe('what a viewer says of what it has drawn', () => {
  it('is the first picture at once, then one of some, then every two seconds that all is well', () => {
    draw(26);
    expect(said.map(({ got }) => got.sequence)).toEqual([0, 2, 4, 6, 8, 10, 12, 14]);
    expect(kinds().slice(-2)).toEqual(['drawn', 'calm']);
    said = [];
    draw(100);
    expect(kinds()).toEqual(['calm', 'calm']);
    expect(said[1]!.atMs - said[0]!.atMs).toBe(2_000);
  });

  it('is said at once of a picture that is late, and often until none was for half a second', () => {
    draw(40);
    said = [];
    draw(1, { lateMs: 45 });
    expect(said).toEqual([{ atMs: 40 * PICTURE_MS + 65, got: { sequence: 40 } }]);
    draw(11);
    expect(kinds()).not.toContain('calm');
    expect(said.length).toBeGreaterThan(4);
    draw(6);
    expect(kinds().at(-1)).toBe('calm');
  });

  it('is said when the next one should have come, once, and at once when it has', () => {
    draw(40);
    const newestMs = nowMs;
    said = [];
    until(newestMs + 3_000);
    expect(said).toEqual([
      { atMs: newestMs + PICTURE_MS + 50, got: { sequence: 39, overdue: true, held_ms: PICTURE_MS + 50 } },
    ]);
    draw(1);
    expect(said.at(-1)).toEqual({ atMs: newestMs + 3_000, got: { sequence: 40 } });
  });

  it('is never calm where it cannot be known what is late', () => {
    draw(100, { clockKnown: false });
    expect(kinds()).not.toContain('calm');
    expect(said.length).toBeGreaterThan(40);
  });

  it('is not calm after a gap', () => {
    draw(40);
    sequence += 1;
    said = [];
    draw(2);
    expect(kinds()).not.toContain('calm');
  });

  it('is said of the last one too, when no more come before anything was known', () => {
    draw(2);
    expect(said.map(({ got }) => got.sequence)).toEqual([0]);
    until(nowMs + 1_000);
    expect(said.map(({ got }) => got.sequence)).toEqual([0, 1]);
    expect(said[1]).toEqual({ atMs: 20 + 120, got: { sequence: 1, held_ms: 120 - PICTURE_MS } });
  });

  it('follows the best way of the last half minute or more, not of all times', () => {
    draw(40);
    draw(25 * 70, { lateMs: 50 });
    expect(kinds().at(-1)).toBe('calm');
  });

  it('counts over the end of the numbers', () => {
    cadence.came(0xffffffff, 0);
    hear(cadence.done({ sequence: 0xffffffff, captureUs: 0, rateHz: RATE_HZ }, 0));
    for (let one = 0; one < 20; one++) {
      nowMs = (one + 1) * PICTURE_MS;
      cadence.came(one, nowMs);
      hear(cadence.done({ sequence: one, captureUs: nowMs * 1000, rateHz: RATE_HZ }, nowMs));
    }
    expect(kinds().at(-1)).toBe('calm');
  });
});
