import { describe, expect, it } from 'vitest';

import {
  fieldBounds,
  fromMetric,
  isUnitSystem,
  meantBy,
  measure,
  measured,
  toMetric,
  UNIT_SYSTEMS,
} from '../../src/words/units';

describe('a quantity', () => {
  it.each([
    ['metric', 'height', 30, '30.0 m'],
    ['imperial', 'height', 30.48, '100 ft'],
    ['aviation', 'height', 30.48, '100 ft'],
    ['metric', 'speed', 10, '10.0 m/s'],
    ['imperial', 'speed', 10, '22.4 mph'],
    ['aviation', 'speed', 10, '19.4 kt'],
    ['metric', 'climb', -1.5, '−1.5 m/s'],
    ['imperial', 'climb', 3.048, '10.0 ft/s'],
    ['aviation', 'climb', 5.08, '1000 ft/min'],
    ['metric', 'distance', 999, '999 m'],
    ['metric', 'distance', 1500, '1.50 km'],
    ['imperial', 'distance', 100, '328 ft'],
    ['imperial', 'distance', 3218.688, '2.00 mi'],
    ['aviation', 'distance', 3704, '2.00 NM'],
  ] as const)('in %s units, %s of %d, is %s', (system, quantity, value, words) => {
    expect(measured(system, quantity, value)).toBe(words);
  });

  it('that is not known is a dash, with its unit apart', () => {
    expect(measured('metric', 'height', null)).toBe('–');
    expect(measure('aviation', 'climb', Number.NaN)).toEqual({ text: '–', unit: 'ft/min' });
  });

  it('near zero has no sign', () => {
    expect(measured('metric', 'climb', -0.04)).toBe('0.0 m/s');
  });

  it('typed in goes there and back', () => {
    for (const { value: system } of UNIT_SYSTEMS) {
      expect(fromMetric(system, 'height', toMetric(system, 'height', 120))).toBe(120);
    }
    expect(toMetric('aviation', 'speed', 1)).toBeCloseTo(0.5144, 4);
  });
});

describe('a field', () => {
  it('that nobody has changed means the very value that it began with', () => {
    expect(fromMetric('imperial', 'height', 20)).toBe(66);
    expect(meantBy('imperial', 'height', 66, 20)).toBe(20);
    expect(meantBy('imperial', 'height', 67, 20)).toBeCloseTo(20.42, 2);
    expect(meantBy('metric', 'height', 25, 20)).toBe(25);
  });

  it('takes nothing that is outside of what is allowed', () => {
    expect(fieldBounds('metric', 'height', 1, 500)).toEqual([1, 500]);
    for (const { value: system } of UNIT_SYSTEMS) {
      const [least, most] = fieldBounds(system, 'height', 1, 500);
      expect(toMetric(system, 'height', least)).toBeGreaterThanOrEqual(1);
      expect(toMetric(system, 'height', most)).toBeLessThanOrEqual(500);
    }
    expect(fieldBounds('aviation', 'height', 1, 500)).toEqual([4, 1640]);
  });
});

it('knows its systems', () => {
  expect(isUnitSystem('aviation')).toBe(true);
  expect(isUnitSystem('furlong')).toBe(false);
});
