import { describe, expect, it } from 'vitest';

import type { Zone } from '../../src/link/zones';
import { heightWords, timeWords, zoneWords } from '../../src/words/zone_words';

const ZONE: Zone = {
  id: 1,
  version: 1,
  name: 'Airport',
  kind: 'no-fly',
  rule: 'refuse',
  points: [],
  width_m: null,
  team_id: null,
  floor_m: null,
  ceiling_m: null,
  height_above: 'home',
  valid_from: null,
  valid_until: null,
  reason: '',
};

describe('a zone in words', () => {
  it('says its heights', () => {
    expect(heightWords(ZONE)).toBe('all heights');
    expect(heightWords({ ...ZONE, ceiling_m: 50 })).toBe('up to 50 m');
    expect(heightWords({ ...ZONE, floor_m: 20, height_above: 'sea' })).toBe('from 20 m above sea level');
    expect(heightWords({ ...ZONE, floor_m: 20, ceiling_m: 50 })).toBe('20 to 50 m');
    expect(heightWords({ ...ZONE, kind: 'height-limit', ceiling_m: 50 })).toBe('at most 50 m');
  });

  it('says its times', () => {
    expect(timeWords(ZONE)).toBe('always');
    expect(timeWords({ ...ZONE, valid_until: '2026-01-02T03:04:05Z' })).toBe('until 2026-01-02 03:04 UTC');
    expect(timeWords({ ...ZONE, valid_from: '2026-01-01T00:00:00Z', valid_until: '2026-01-02T00:00:00Z' })).toBe(
      '2026-01-01 00:00 to 2026-01-02 00:00 UTC',
    );
  });

  it('says its kind, and that it only warns', () => {
    expect(zoneWords({ ...ZONE, rule: 'warn' })).toBe('No-fly zone, all heights, always, only warns');
  });
});
