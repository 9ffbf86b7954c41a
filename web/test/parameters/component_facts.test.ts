import fc from 'fast-check';
import { describe, expect, it } from 'vitest';

import { factsOfComponent, factWithVehicle, withVehicle } from '../../src/parameters/component_facts';
import { searchText } from '../../src/parameters/listing';
import { factOf, factsOf } from '../../src/parameters/facts';

const FILE = {
  version: 1,
  parameters: [
    {
      name: 'ALPHA',
      type: 'Float',
      shortDesc: 'Of the vehicle',
      longDesc: 'Long.',
      min: 1,
      max: 9,
      default: 4,
      units: 'm',
    },
    {
      name: 'MODE',
      shortDesc: 'Its mode',
      values: [
        { value: 1, description: 'Stay' },
        { value: 0, description: 'Go' },
      ],
    },
    { name: 'MASK', bitmask: [{ index: 2, description: 'Two' }], rebootRequired: true },
    { name: 'OUT{n}_MIN', shortDesc: 'Lowest', min: 800, max: 2200 },
    { name: 'ODD', min: 9, max: 1, values: 'none' },
    { type: 'Int32' },
    7,
  ],
};
const OURS = factsOf('ALPHA | Our words | They stay.\nMODE | Mode | What it does.\n  = 1 Hold, 5 Gone', {
  numbers: { ALPHA: ['cm', 0, 100, 50, false], BETA: ['s', 0, 2, 1, false] },
  choices: {},
  bits: {},
  lists: [],
});

describe("a vehicle's own metadata", () => {
  const vehicle = factsOfComponent(FILE);

  it('is read: numbers, lists in order, names with a number in them', () => {
    expect(factOf(vehicle, 'ALPHA')).toMatchObject({
      title: 'Of the vehicle',
      least: 1,
      most: 9,
      standard: 4,
      unit: 'm',
    });
    expect(factOf(vehicle, 'MODE')?.choices.map(({ value }) => value)).toEqual([0, 1]);
    expect(factOf(vehicle, 'MASK')).toMatchObject({ title: '', needsReboot: true, bits: [{ value: 2, words: 'Two' }] });
    expect(factOf(vehicle, 'OUT3_MIN')).toMatchObject({ title: 'Lowest', least: 800 });
    expect(factOf(vehicle, 'ODD')).toMatchObject({ least: null, most: null, choices: [] });
  });

  it('wins over ours with its numbers and values, while our words stay', () => {
    const alpha = factWithVehicle(OURS, vehicle, 'ALPHA');
    expect(alpha).toMatchObject({ title: 'Our words', text: 'They stay.', least: 1, most: 9, standard: 4, unit: 'm' });
    expect(factWithVehicle(OURS, vehicle, 'MODE')?.choices).toEqual([
      { value: 0, words: 'Go' },
      { value: 1, words: 'Hold' },
    ]);
    expect(factWithVehicle(OURS, vehicle, 'BETA')).toMatchObject({ unit: 's', standard: 1 });
    expect(factWithVehicle(OURS, vehicle, 'MASK')?.bits).toHaveLength(1);
    expect(factWithVehicle(OURS, vehicle, 'NONE')).toBeNull();
  });

  it('is laid over ours wherever a fact is looked up, and ours stay as they are', () => {
    const both = withVehicle(OURS, vehicle);
    for (const name of ['ALPHA', 'MODE', 'BETA', 'MASK', 'OUT7_MIN', 'NONE']) {
      expect(factOf(both, name)).toEqual(factWithVehicle(OURS, vehicle, name));
    }
    expect(factOf(both, 'OUT7_MIN')).toMatchObject({ title: 'Lowest', most: 2200 });
    expect(factOf(OURS, 'ALPHA')).toMatchObject({ unit: 'cm', most: 100 });
    expect(searchText('ODD2', both)).toBe(searchText('ODD2', OURS));
    expect(searchText('OUT7_MIN', both)).toContain('lowest');
  });

  it('of any shape is read or refused, never worse', () => {
    fc.assert(
      fc.property(fc.jsonValue(), fc.array(fc.jsonValue()), (a, parameters) => {
        for (const json of [
          a,
          { version: 1, parameters: a },
          { version: 1, parameters: [...parameters, { name: 'X', values: a }] },
        ]) {
          try {
            factsOfComponent(json);
          } catch (error) {
            expect(error).toBeInstanceOf(RangeError);
          }
        }
      }),
    );
  });
});
