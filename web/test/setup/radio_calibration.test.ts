import { expect, test } from 'vitest';

import type { MessageFields } from '../../src/link/generated/mavlink.gen';
import { calibrated, channelsOf, fresh, isMoved, moved, type Channel } from '../../src/setup/radio_calibration';

const heard = (...pwm: number[]): MessageFields['RC_CHANNELS'] =>
  ({
    chancount: pwm.length,
    ...Object.fromEntries(pwm.map((value, at) => [`chan${at + 1}_raw`, value])),
  }) as unknown as MessageFields['RC_CHANNELS'];
const after = (...all: number[][]): readonly Channel[] =>
  all.reduce<readonly Channel[]>((channels, pwm) => moved(channels, heard(...pwm), true), []);

test('channels without a receiver are none', () => {
  expect(channelsOf(heard(1500, 0, 65535, 1000))).toEqual([
    { number: 1, now: 1500 },
    { number: 4, now: 1000 },
  ]);
});

test('the ends that were reached become the range', () => {
  const channels = after(
    [1500, 1500, 1010, 1500],
    [1980, 1500, 2000, 1520],
    [1020, 1500, 1010, 1490],
    [1502, 1500, 1012, 1500],
  );
  expect(channels.map(isMoved)).toEqual([true, false, true, false]);
  expect(calibrated(channels, 3)).toEqual({
    RC1_MIN: 1020,
    RC1_MAX: 1980,
    RC1_TRIM: 1502,
    RC3_MIN: 1010,
    RC3_MAX: 2000,
    RC3_TRIM: 1010,
  });
});

test('nothing is learnt before it begins', () => {
  const still = moved([{ number: 1, now: 1500, min: 1500, max: 1500 }], heard(1900), false);
  expect(still).toEqual([{ number: 1, now: 1900, min: 1500, max: 1500 }]);
  expect(fresh(still)).toEqual([{ number: 1, now: 1900, min: 1900, max: 1900 }]);
});
