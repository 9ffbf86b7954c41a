import { afterEach, describe, expect, it } from 'vitest';

import { languageFor } from '../../src/languages/languages';
import { plural, t, tAs, useCatalogue, type Catalogue } from '../../src/languages/text';
import { dateMinute, dateTime, fileTime } from '../../src/words/dates';
import { distance, fixed } from '../../src/words/format';
import { measured } from '../../src/words/units';

const PORTUGUESE: Catalogue = {
  'Hold {drone}': 'Parar {drone}',
  '{a} before {b}': '{b} depois de {a}',
  Open: 'Aberto',
  'Open [[verb]]': 'Abrir',
  '{n} drones of {owner}': { one: '{n} drone de {owner}', other: '{n} drones de {owner}' },
  Blank: '',
};

const drones = (n: number): string =>
  plural(n, { one: '{n} drone of {owner}', other: '{n} drones of {owner}' }, { owner: 'Ana' });

afterEach(() => useCatalogue('en', null));

describe('English', () => {
  it('is the key itself, with its values in it', () => {
    expect(t('Hold {drone}', { drone: 'Merlin' })).toBe('Hold Merlin');
    expect(t('{n} of {n}', { n: 2 })).toBe('2 of 2');
    expect(tAs('verb', 'Open')).toBe('Open');
    expect(t('Lost {what}', { what: undefined })).toBe('Lost ');
  });

  it('does not read values for placeholders', () => {
    expect(t('Hold {drone}', { drone: '{drone} $&' })).toBe('Hold {drone} $&');
  });

  it('counts', () => {
    expect([0, 1, 2, 1.5].map(drones)).toEqual([
      '0 drones of Ana',
      '1 drone of Ana',
      '2 drones of Ana',
      '1.5 drones of Ana',
    ]);
  });

  it('writes numbers and dates as it always did', () => {
    expect(fixed(-1.25, 1)).toBe('−1.3');
    expect(dateTime('2026-03-04T05:06:07Z')).toBe('2026-03-04 05:06:07');
    expect(dateMinute('2026-03-04T05:06:07Z')).toBe('2026-03-04 05:06');
  });
});

describe('another language', () => {
  it('has its own words, in its own order', () => {
    useCatalogue('pt', PORTUGUESE);
    expect(t('Hold {drone}', { drone: 'Merlin' })).toBe('Parar Merlin');
    expect(t('{a} before {b}', { a: 'um', b: 'dois' })).toBe('dois depois de um');
    expect(t('Open')).toBe('Aberto');
    expect(tAs('verb', 'Open')).toBe('Abrir');
  });

  it('falls back to English where it lacks a text', () => {
    useCatalogue('pt', PORTUGUESE);
    expect(t('Not translated')).toBe('Not translated');
    // @ts-expect-error a text of this test, not of the console
    expect(t('Blank' as string)).toBe('Blank');
    expect(plural(1, { one: 'one', other: 'some' })).toBe('one');
  });

  it('counts by its own rules: in Portuguese 0 is singular', () => {
    useCatalogue('pt', PORTUGUESE);
    expect([0, 1, 2].map(drones)).toEqual(['0 drone de Ana', '1 drone de Ana', '2 drones de Ana']);
  });

  it('writes numbers and dates in its way, and names of files as ever', () => {
    useCatalogue('pt', PORTUGUESE);
    expect(fixed(-1.25, 1)).toBe('−1,3');
    expect(distance(1234)).toBe('1,23 km');
    expect(measured('metric', 'height', 12.5)).toBe('12,5 m');
    expect(t('Hold {drone}', { drone: 2.5 })).toBe('Parar 2,5');
    expect(dateTime('2026-03-04T15:06:07Z')).toMatch(/^04\/03\/(20)?26,? 15:06:07$/);
    expect(fileTime('2026-03-04T15:06:07Z')).toBe('2026-03-04 15:06:07');
  });
});

describe('types', () => {
  it('refuse a lacking value, a surplus one, and a text that is not known', () => {
    const text: string = 'from elsewhere';
    // @ts-expect-error lacking
    t('Hold {drone}');
    // @ts-expect-error surplus
    t('Hold {drone}', { drone: 'Merlin', other: 1 });
    // @ts-expect-error misspelt
    t('Hold {drone}', { dron: 'Merlin' });
    // @ts-expect-error takes none
    t('Hold', { drone: 'Merlin' });
    // @ts-expect-error cannot be collected
    t(text);
    expect(text).toBe('from elsewhere');
  });
});

describe('the language of a browser', () => {
  const both = ['en', 'pt'] as const;
  it.each([
    ['system', ['pt-BR', 'en'], 'pt'],
    ['system', ['de', 'PT'], 'pt'],
    ['system', ['en-GB', 'pt'], 'en'],
    ['system', ['de'], 'en'],
    ['system', [], 'en'],
    ['pt', ['en'], 'pt'],
    ['en', ['pt'], 'en'],
  ] as const)('%s of %j is %s', (choice, wanted, language) => {
    expect(languageFor(choice, wanted, both)).toBe(language);
  });
});
