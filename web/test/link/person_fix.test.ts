import { describe, expect, it } from 'vitest';

import { ageMs, personFixText, sureM, type Located } from '../../src/link/person_fix';

const located = (changes: Partial<Located['coords']> = {}): Located => ({
  timestamp: 1_000_000,
  coords: { latitude: 47.4, longitude: 8.5, accuracy: 4, speed: null, heading: null, ...changes },
});

describe('where the person is', () => {
  it('is told with its age and our clock', () => {
    expect(JSON.parse(personFixText(7, located({ speed: 1.5, heading: 90 }), 1_000_250, 2 ** 32 + 12.7))).toEqual({
      type: 'person_fix',
      drone_id: 7,
      lat: 47.4,
      lon: 8.5,
      accuracy_m: 4,
      age_ms: 250,
      sent_ms: 12,
      speed_m_s: 1.5,
      heading_deg: 90,
    });
  });

  it('has no heading while the person stands: a browser then says NaN', () => {
    const reported = JSON.parse(personFixText(7, located({ speed: 0, heading: NaN }), 1_000_000, 0)) as object;
    expect(reported).toMatchObject({ speed_m_s: 0, heading_deg: null });
  });

  it('is not younger than now, and however old it is the message is one that the tower takes', () => {
    expect(ageMs(located(), 999_000)).toBe(0);
    const old = JSON.parse(personFixText(7, located(), 1_000_000 + 9e9, 0)) as { age_ms: number };
    expect(old.age_ms).toBe(3_600_000);
  });

  it('must be as sure as the drone is away, and 20 m at the worst', () => {
    expect([8, 15, 50].map(sureM)).toEqual([8, 15, 20]);
  });
});
