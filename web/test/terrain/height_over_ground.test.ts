import { expect, it } from 'vitest';

import type { Place } from '../../src/link/messages';
import { heightOverGroundM } from '../../src/terrain/height_over_ground';

const home = { latDeg: 47, lonDeg: 8 };
const place = { latDeg: 47.001, lonDeg: 8 };
const ground = ({ latDeg }: Place): number => (latDeg > 47 ? 440 : 400);

it('is measured from the ground at home, and above the sea without a home', () => {
  // Its receiver has the sea wrong by 12 m.
  const values = { place, home, altRelM: 60, altAmslM: 472 };
  expect(heightOverGroundM(values, ground)).toBe(20);
  expect(heightOverGroundM({ ...values, home: null }, ground)).toBe(32);
});

it('is not known without the ground or the place', () => {
  const values = { place, home, altRelM: 60, altAmslM: 472 };
  expect(heightOverGroundM(values, () => null)).toBeNull();
  expect(heightOverGroundM(values, () => undefined)).toBeNull();
  expect(heightOverGroundM({ ...values, place: null }, ground)).toBeNull();
});
