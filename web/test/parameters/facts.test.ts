import { describe, expect, it } from 'vitest';

import { factOf, hasBit, meaningOf, rangeWords, readFacts, unusualWords, withBit } from '../../src/parameters/facts';
import { ARDUCOPTER } from '../../src/parameters/facts/arducopter';
import { PX4 } from '../../src/parameters/facts/px4';
import { loadFacts } from '../../src/parameters/load_facts';

describe.each([
  ['ArduCopter', ARDUCOPTER, 190],
  ['PX4', PX4, 80],
])('the facts about %s', (_name, source, atLeast) => {
  const facts = readFacts(source);

  it('are about many parameters, each with a name that MAVLink can carry', () => {
    expect(facts.size).toBeGreaterThan(atLeast);
    for (const name of facts.keys()) expect(name).toMatch(/^[A-Z][A-Z0-9_#]{1,15}$/);
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
  const facts = await loadFacts('arducopter');
  expect(factOf(facts, 'RC7_MAX')?.title).toBe('Channel 7: highest');
  expect(factOf(facts, 'EK3_SRC2_YAW')?.title).toBe('Heading from (set 2)');
  expect(factOf(facts, 'BATT_CAPACITY')?.title).toBe('Capacity');
  expect(factOf(facts, 'NO_SUCH_NAME')).toBeNull();
});

it('knows numbers of parameters that there are no words about', async () => {
  const facts = await loadFacts('arducopter');
  const fact = factOf(facts, 'ACRO_RP_RATE');
  expect(fact).toMatchObject({ title: '', unit: 'deg/s', least: 1, most: 1080, standard: 360 });
  expect(unusualWords(fact, 2000)).toBe('Usually not above 1080 deg/s.');
  expect((await loadFacts('other')).words.size).toBe(0);
});

it('says a value in words', async () => {
  const facts = await loadFacts('arducopter');
  expect(meaningOf(factOf(facts, 'FLTMODE3'), 6)).toBe('Return');
  expect(meaningOf(factOf(facts, 'FENCE_TYPE'), 3)).toBe('Greatest height, Circle around home');
  expect(meaningOf(factOf(facts, 'FENCE_TYPE'), 0)).toBe('none');
  expect(meaningOf(factOf(facts, 'WPNAV_SPEED'), 500)).toBe('');
  expect(unusualWords(factOf(facts, 'FENCE_ACTION'), 9)).toBe('This is none of the known choices.');
});

it('says a range in words', async () => {
  const facts = await loadFacts('arducopter');
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
