import { expect, it } from 'vitest';

import type { Aircraft } from '../../src/link/wire_types';
import { aircraftWords } from '../../src/map/aircraft_overlay';

const AIRCRAFT: Aircraft = {
  key: 'icao:4b1234',
  manned: true,
  name: 'HELI1',
  lat: 47,
  lon: 8,
  alt_amsl_m: 650,
  course_deg: 90,
  speed_m_s: 50,
  climb_m_s: 0,
  squawk: null,
  on_ground: false,
  age_s: 0.4,
};

it('says the height above the drone, the climb, and the age of an old position', () => {
  expect(aircraftWords(AIRCRAFT, 500)).toBe('+150 m');
  expect(aircraftWords({ ...AIRCRAFT, climb_m_s: -3 }, 700)).toBe('−50 m ↓');
  expect(aircraftWords({ ...AIRCRAFT, age_s: 12.2 }, null)).toBe('650 m AMSL, 12 s ago');
  expect(aircraftWords({ ...AIRCRAFT, alt_amsl_m: null }, 500)).toBe('height ?');
});
