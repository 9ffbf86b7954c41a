import { afterEach, describe, expect, it } from 'vitest';

import { useTowerTexts } from '../src/languages/tower_text';
import {
  changedSettings,
  defaultsOf,
  isInRange,
  settingFault,
  type ControllerSetting,
} from '../src/link/controller_settings';
import { refusedWords, settingHint, settingRange } from '../src/words/controller_words';

const setting = (more: Partial<ControllerSetting>): ControllerSetting => ({
  name: 'height_m',
  kind: 'number',
  label: 'Search height',
  about: '',
  default: 10,
  unit: 'm',
  least: 2,
  most: 60,
  choices: [],
  characters: '',
  most_characters: 400,
  is_rare: false,
  ...more,
});
const HEIGHT = setting({});
const LETTER = setting({ name: 'letter', kind: 'text', default: '', unit: '', characters: 'ABK', most_characters: 2 });
const CAMERA = setting({ name: 'camera', kind: 'camera', default: '', unit: '', choices: ['', 'down'] });

afterEach(() => {
  useTowerTexts(null);
});

describe('a value', () => {
  it.each<[ControllerSetting, string | number | null, RegExp]>([
    [HEIGHT, 61, /^range$/],
    [HEIGHT, 1.9, /^range$/],
    [HEIGHT, null, /number is needed/],
    [HEIGHT, Number.NaN, /number is needed/],
    [HEIGHT, '10', /number is needed/],
    [LETTER, 'ABK', /At most 2 characters/],
    [LETTER, 'AZ', /“Z” cannot be in it/],
    [CAMERA, 'up', /one of the list/],
  ])('%# is refused before anything is sent', (one, value, words) => {
    expect(settingFault(one, value, 'range')).toMatch(words);
  });

  it.each<[ControllerSetting, string | number]>([
    [HEIGHT, 2],
    [HEIGHT, 60 + 1e-9],
    [LETTER, ''],
    [LETTER, 'KA'],
    [CAMERA, ''],
    [CAMERA, 'down'],
    [setting({ kind: 'text', most_characters: 1 }), '🙂'],
  ])('%# is good', (one, value) => {
    expect(settingFault(one, value, 'range')).toBe('');
  });

  it('has no bound on a side that the controller does not name', () => {
    expect(isInRange(setting({ least: null }), -1e9)).toBe(true);
    expect(isInRange(setting({ most: null }), 1e9)).toBe(true);
    expect(isInRange(setting({ most: null }), 1)).toBe(false);
  });
});

describe('what is sent', () => {
  const all = [HEIGHT, LETTER, CAMERA];

  it('is nothing for a form that nobody touched', () => {
    expect(defaultsOf(all)).toEqual({ height_m: 10, letter: '', camera: '' });
    expect(changedSettings(all, defaultsOf(all))).toEqual({});
  });

  it('is what was changed, within its range', () => {
    expect(changedSettings(all, { height_m: 60 + 1e-9, letter: 'K', camera: '' })).toEqual({
      height_m: 60,
      letter: 'K',
    });
  });
});

describe('words', () => {
  it.each<[Partial<ControllerSetting>, string]>([
    [{}, 'From 2 m to 60 m. Default: 10 m.'],
    [{ default: 0.35, least: 0.05, most: 5 }, 'From 0.05 m to 5 m. Default: 0.35 m.'],
    [{ unit: 's', most: null }, 'At least 2 s. Default: 10 s.'],
    [{ unit: '', least: null }, 'At most 60. Default: 10.'],
    [{ kind: 'text', default: 'squares', least: null, most: null }, 'Default: squares.'],
    [{ kind: 'text', default: '', least: null, most: null }, ''],
  ])('of the range and the default: %j', (more, words) => {
    expect(settingHint(setting(more), 'metric')).toBe(words);
  });

  it('are in the units of the person', () => {
    expect(settingRange(HEIGHT, 'imperial')).toBe('From 6.56 ft to 196.85 ft.');
    expect(settingRange(setting({ unit: 'm/s', least: 1, most: 10 }), 'aviation')).toBe('From 1.94 kt to 19.44 kt.');
  });

  it('name the setting in the language of the person', () => {
    useTowerTexts({ 'Search height': 'Altura da procura' });
    expect(refusedWords(HEIGHT, 'tem de ser menor')).toBe('Altura da procura: tem de ser menor');
  });
});
