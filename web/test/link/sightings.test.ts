import { expect, it } from 'vitest';

import type { FindingEvent } from '../../src/link/findings';
import { Sightings, type SightingEvent } from '../../src/link/sightings';

const BOX = { x: 0.5, y: 0.5, width: 0.1, height: 0.1, age_s: 0.3 };
const sighting = (drone_id: number, letter: string): SightingEvent => ({
  type: 'sighting',
  drone_id,
  letter,
  confidence: 0.9,
  in_video: BOX,
});
const finding = (in_video: typeof BOX | null | undefined): FindingEvent => ({
  type: 'finding',
  drone_id: 1,
  finding: {
    number: 1,
    at: '2026-01-01T00:00:00Z',
    letter: 'F',
    confidence: 0.8,
    lat_deg: 47,
    lon_deg: 8,
    thumbnail: '',
    ...(in_video === undefined ? {} : { in_video }),
  },
});

it('keeps the newest of each drone with the time of its picture', () => {
  let nowMs = 1_000;
  const sightings = new Sightings({ monotonicMs: () => nowMs });
  sightings.take(sighting(1, 'A'));
  nowMs = 2_000;
  sightings.take(sighting(2, 'B'));
  sightings.take(sighting(1, 'C'));
  const all = sightings.newest.get();
  expect([all.get(1)?.letter, all.get(2)?.letter]).toEqual(['C', 'B']);
  expect(all.get(1)?.takenMs).toBe(1_700);
  sightings.forget();
  expect(sightings.newest.get().size).toBe(0);
});

it('takes findings that the video shows, and no others', () => {
  const sightings = new Sightings({ monotonicMs: () => 0 });
  sightings.take(finding(null));
  sightings.take(finding(undefined));
  expect(sightings.newest.get().size).toBe(0);
  sightings.take(finding(BOX));
  expect(sightings.newest.get().get(1)?.letter).toBe('F');
});
