import { readFileSync } from 'node:fs';

import { describe, expect, it } from 'vitest';

import { spelledOut } from '../../src/parameters/abbreviations';
import {
  factOf,
  factsOf,
  hasBit,
  meaningOf,
  rangeWords,
  readFacts,
  unusualWords,
  withBit,
} from '../../src/parameters/facts';
import { ARDUCOPTER_WORDS } from '../../src/parameters/facts/arducopter_words';
import { PX4_WORDS } from '../../src/parameters/facts/px4_words';
import { loadFacts } from '../../src/parameters/load_facts';

describe.each([
  ['ArduCopter', ARDUCOPTER_WORDS, 800],
  ['PX4', PX4_WORDS, 160],
])('the facts about %s', (_name, source, atLeast) => {
  const facts = readFacts(source);

  it('are about many parameters, each with a name that MAVLink can carry', () => {
    expect(facts.size).toBeGreaterThan(atLeast);
    for (const name of facts.keys()) expect(name).toMatch(/^[A-Z][A-Z0-9_#]{1,14}([A-Z0-9_#]|\*)$/);
  });

  it('have choices and bits once each, and ranges that begin before they end', () => {
    for (const [name, fact] of facts) {
      for (const list of [fact.choices, fact.bits]) {
        expect(new Set(list.map(({ value }) => value)).size, name).toBe(list.length);
      }
      expect(
        [fact.least, fact.most, fact.standard].every((one) => one === null || Number.isFinite(one)),
        name,
      ).toBe(true);
      if (fact.least !== null && fact.most !== null) expect(fact.least, name).toBeLessThan(fact.most);
      expect(fact.text, name).toMatch(/\.$/);
    }
  });

  it('have defaults among their choices and bits', () => {
    for (const [name, { standard, choices, bits }] of facts) {
      if (standard === null) continue;
      if (choices.length > 0)
        expect(
          choices.map(({ value }) => value),
          name,
        ).toContain(standard);
      const known = bits.reduce((sum, { value }) => sum + 2 ** value, 0);
      if (bits.length > 0) expect(Number(BigInt(standard) & ~BigInt(known)), name).toBe(0);
    }
  });
});

it('tells of numbered parameters by their pattern, with their number', async () => {
  const facts = await loadFacts('ardupilot');
  expect(factOf(facts, 'RC7_MAX')?.title).toBe('Channel 7: highest');
  expect(factOf(facts, 'EK3_SRC2_YAW')?.title).toBe('Heading from (set 2)');
  expect(factOf(facts, 'BATT_CAPACITY')?.title).toBe('Capacity');
  expect(factOf(facts, 'NO_SUCH_NAME')).toBeNull();
});

it.each([
  ['ardupilot', 1001],
  ['px4', 907],
] as const)('has words about each parameter that a real %s lists', async (kind, count) => {
  const facts = await loadFacts(kind);
  const names = readFileSync(new URL(`${kind}_names.txt`, import.meta.url), 'utf8')
    .trim()
    .split('\n');
  expect(names).toHaveLength(count);
  for (const name of names) {
    const fact = factOf(facts, name);
    expect([fact?.title, fact?.text], name).not.toContain('');
    expect(fact, name).not.toBeNull();
    expect(`${fact?.title} ${fact?.text}`, name).not.toMatch(/[#*]/);
  }
});

it('spells out what the names of a family abbreviate', async () => {
  expect(spelledOut('MAIN_FUNC3')).toBe('main function 3');
  expect(spelledOut('STRT_DUR')).toBe('STRT_DUR');
  expect(spelledOut('STRT_TIME')).toBe('STRT time');
  const facts = await loadFacts('ardupilot');
  expect(factOf(facts, 'ADSB_EMIT_TYPE')?.title).toBe('ADS-B: emitter kind');
});

it('knows what PX4 1.15 and 1.16 have brought', async () => {
  const facts = await loadFacts('px4');
  expect(factOf(facts, 'GF_ACTION')).toMatchObject({ least: 0, most: 5 });
  expect(factOf(facts, 'MC_ORBIT_YAW_MOD')?.choices.find(({ value }) => value === 3)?.words).toBe(
    'Nose along the circle',
  );
  expect(factOf(facts, 'ICE_STRT_DUR')).toMatchObject({ title: 'Combustion engine: STRT_DUR', unit: 's' });
  expect(factOf(facts, 'RO_SPEED_LIM')?.unit).toBe('m/s');
});

it('says a range, a unit, choices and bits where only the metadata has them', async () => {
  const facts = await loadFacts('ardupilot');
  const fact = factOf(facts, 'ACRO_RP_RATE');
  expect(fact).toMatchObject({ title: 'Fastest roll and pitch', unit: 'deg/s', least: 1, most: 1080, standard: 360 });
  expect(unusualWords(fact, 2000)).toBe('Usually not above 1080 deg/s.');
  expect(meaningOf(factOf(facts, 'AVOID_BEHAVE'), 1)).toBe('Stop');
  expect(factOf(facts, 'EK3_GPS_CHECK')?.bits.length).toBeGreaterThan(5);
  expect(factOf(await loadFacts('px4'), 'COM_FLTMODE3')?.choices.length).toBeGreaterThan(10);
  expect((await loadFacts('other')).words.size).toBe(0);
});

it('has our words for a value first, and those of the metadata for the rest', async () => {
  const facts = await loadFacts('ardupilot');
  const functions = factOf(facts, 'SERVO5_FUNCTION')!.choices;
  expect(functions.find(({ value }) => value === 10)?.words).toBe('Camera trigger');
  expect(functions.length).toBeGreaterThan(120);
  const values = functions.map(({ value }) => value);
  expect(values).toEqual(values.toSorted((a, b) => a - b));
  expect(new Set(values).size).toBe(values.length);
});

it('lets other values be typed where the choices are some of many', async () => {
  const [copter, px4] = [await loadFacts('ardupilot'), await loadFacts('px4')];
  const isOpen = (name: string): boolean | undefined => factOf(copter, name)?.isOpen;
  expect(['GPS1_RATE_MS', 'RELAY1_PIN', 'NTF_BUZZ_PIN', 'PSC_ANGLE_MAX', 'BATT_CAPACITY'].map(isOpen)).toEqual([
    true,
    true,
    true,
    false,
    false,
  ]);
  expect(['FLTMODE1', 'SERVO1_FUNCTION', 'AVOID_BEHAVE', 'ARMING_RUDDER'].map(isOpen)).toEqual([
    false,
    false,
    false,
    false,
  ]);
  expect(unusualWords(factOf(copter, 'RELAY1_PIN'), 77)).toBe('');
  expect(factOf(px4, 'COM_FLTMODE1')?.isOpen).toBe(false);
});

it('says of the second of a kind what it says of the first, and of a family what all of it is about', () => {
  const facts = factsOf('BATT_LOW | Low at | Below it the battery is low.\nOSD#_* | Page #: * | What page # shows.', {
    numbers: { 'OSD#_WIND_X': ['', 0, 60, null, false] },
    choices: {},
    bits: {},
    lists: [],
  });
  expect(factOf(facts, 'BATT2_LOW')).toMatchObject({ title: 'Low at (2)', text: 'Below it the battery is low.' });
  expect(factOf(facts, 'OSD3_WIND_X')).toMatchObject({ title: 'Page 3: wind X', text: 'What page 3 shows.', most: 60 });
  expect(factOf(facts, 'OSD_WIND_X')).toBeNull();
});

it.each(['ardupilot', 'px4'] as const)(
  'the metadata of %s has lists that can be read, and no name twice',
  async (kind) => {
    const { choices, bits, numbers } = await loadFacts(kind);
    expect(choices.size).toBeGreaterThan(200);
    expect(bits.size).toBeGreaterThan(20);
    for (const list of [...choices.values(), ...bits.values()]) {
      expect(list.length).toBeGreaterThan(0);
      expect(new Set(list.map(({ value }) => value)).size).toBe(list.length);
    }
    for (const [name, [, least, most]] of numbers) {
      if (least !== null && most !== null) expect(least, name).toBeLessThan(most);
    }
  },
);

it('says a value in words', async () => {
  const facts = await loadFacts('ardupilot');
  expect(meaningOf(factOf(facts, 'FLTMODE3'), 6)).toBe('Return');
  expect(meaningOf(factOf(facts, 'FENCE_TYPE'), 3)).toBe('Maximum height, Circle around home');
  expect(meaningOf(factOf(facts, 'FENCE_TYPE'), 0)).toBe('none');
  expect(meaningOf(factOf(facts, 'WPNAV_SPEED'), 500)).toBe('');
  expect(unusualWords(factOf(facts, 'FENCE_ACTION'), 9)).toBe('This is none of the known choices.');
});

it('says a range in words', async () => {
  const facts = await loadFacts('ardupilot');
  expect(rangeWords(factOf(facts, 'ACRO_RP_RATE'))).toBe('Usually 1 to 1080 deg/s');
  expect(rangeWords(factOf(facts, 'BATT_CAPACITY'))).toBe('Usually from 0 mAh');
  expect(rangeWords(factOf(facts, 'FLTMODE1'))).toBe('');
});

it('sets and clears bits beyond those of a small number', () => {
  expect(hasBit(2 ** 31, 31)).toBe(true);
  expect(withBit(5, 1, true)).toBe(7);
  expect(withBit(7, 1, true)).toBe(7);
  expect(withBit(2 ** 31 + 1, 31, false)).toBe(1);
});

it.each(['NAME | only a title', 'NAME | title | m | 1..2 | 1 | | text | and more', '| no name | | | | | text.'])(
  'refuses the line %s',
  (line) => {
    expect(() => readFacts(line)).toThrow(RangeError);
  },
);
