import { describe, expect, it } from 'vitest';

import { importIdOf, importKey } from '../../src/link/flight_imports';
import { apartM, paired } from '../../src/replay/beside';
import { importNote } from '../../src/words/flight_words';

const flight = (fromMs: number, wholeToMs: number, takeOffMs: number) => ({ fromMs, wholeToMs, takeOffMs });

describe('two flights', () => {
  it('are aligned at their take-offs, on a timeline that has both', () => {
    expect(paired(flight(1_000, 9_000, 3_000), flight(100_000, 102_500, 101_000))).toEqual({
      fromMs: 1_000,
      toMs: 9_000,
      laterMs: 98_000,
    });
    expect(paired(flight(1_000, 2_500, 2_000), flight(100_000, 110_000, 105_000))).toEqual({
      fromMs: -3_000,
      toMs: 7_000,
      laterMs: 103_000,
    });
  });

  it('wait for each other', () => {
    expect(paired(flight(0, 0, 0), flight(1, 2, 1))).toBeNull();
    expect(paired(flight(1, 2, 1), flight(0, 0, 0))).toBeNull();
  });

  it('are apart by the distance over ground', () => {
    expect(apartM({ latDeg: 47, lonDeg: 8 }, { latDeg: 47.001, lonDeg: 8 })).toBeCloseTo(111.2, 0);
    expect(apartM(null, { latDeg: 47, lonDeg: 8 })).toBeNull();
  });
});

describe('an imported flight', () => {
  it('has an address of its own', () => {
    expect(importIdOf(importKey('0123456789abcdef'))).toBe('0123456789abcdef');
    expect(importIdOf('12')).toBeNull();
  });

  it('says what is to be known of its file', () => {
    const about = { format: 'dataflash', clock_known: false, skipped_bytes: 2_000 } as Parameters<typeof importNote>[0];
    expect(importNote(about)).toBe(
      'Dataflash log of ArduPilot; no time of day: it begins at the import; 2.0 kB could not be read',
    );
    const jumps = [{ at: '2026-07-01T12:00:00Z', by_s: 94_608_000 }];
    expect(importNote({ ...about, format: 'tlog', clock_known: true, skipped_bytes: 0, clock_jumps: jumps })).toBe(
      "Telemetry log; its computer's clock was set in between: times are those of the autopilot",
    );
    expect(importNote({ ...about, format: 'ulog', clock_known: true, skipped_bytes: 0 })).toBe('ULog of PX4');
  });
});
