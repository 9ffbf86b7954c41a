import { expect, test } from 'vitest';

import { ValueHistory } from '../../src/values/value_history';
import {
  addedItem,
  itemOf,
  layoutOf,
  layoutOfText,
  layoutText,
  limitTone,
  MAX_CHARACTERS,
  MAX_ITEMS,
  movedItem,
  NO_CHOICES,
  readChoices,
  readLayout,
  savedAs,
  USUAL_LAYOUT,
  withLayout,
} from '../../src/values/value_layout';

const layout = ['a', 'b', 'c'].map(itemOf);
const ids = (items: readonly { id: string }[]): string => items.map(({ id }) => id).join('');

test('anything can be read, and what is no item is left out', () => {
  expect(readLayout('x')).toBeNull();
  const read = readLayout([
    { id: 'climb', size: 'huge', look: 'gauge', low: 'x', high: 3 },
    { id: '<b>' },
    null,
    { id: 'climb' },
  ]);
  expect(read).toEqual([{ id: 'climb', size: 'small', look: 'gauge', low: null, high: 3 }]);
  expect(readChoices(null)).toEqual(NO_CHOICES);
  expect(readChoices({ kinds: { x: 3 }, saved: [{ name: '' }, 7] })).toEqual(NO_CHOICES);
});

test('the longest document fits the tower', () => {
  const long = [...Array(MAX_ITEMS).keys()].map((at) => ({
    ...itemOf(`${'x'.repeat(44)}${at}`),
    look: 'sparkline' as const,
    low: -1000,
    high: 1000,
  }));
  let choices = NO_CHOICES;
  for (const name of ['one', 'two', 'three', 'four']) {
    choices = savedAs(withLayout(choices, name, long), name, long);
    expect(JSON.stringify(choices).length).toBeLessThanOrEqual(MAX_CHARACTERS);
    expect(layoutOf(choices, name)).toEqual(long); // the newest stays
  }
  expect(readChoices(JSON.parse(JSON.stringify(choices)))).toEqual(choices);
});

test('items move, are added once, and stay within the list', () => {
  expect(ids(movedItem(layout, 0, 2))).toBe('bca');
  expect(ids(movedItem(layout, 2, 0))).toBe('cab');
  expect(movedItem(layout, 0, -1)).toBe(layout);
  expect(movedItem(layout, 9, 0)).toBe(layout);
  expect(addedItem(layout, 'a')).toBe(layout);
  expect(ids(addedItem(layout, 'VIBRATION.vibration_x'))).toBe('abcVIBRATION.vibration_x');
});

test('a kind has its layout, others the usual one', () => {
  const choices = withLayout(NO_CHOICES, 'copter', layout);
  expect(layoutOf(choices, 'copter')).toBe(layout);
  expect(layoutOf(choices, 'plane')).toBe(USUAL_LAYOUT);
  expect(layoutOf(withLayout(choices, 'copter', null), 'copter')).toBe(USUAL_LAYOUT);
});

test('saved by name, and sent as text', () => {
  const twice = savedAs(savedAs(NO_CHOICES, 'night', layout), 'night', [itemOf('z')]);
  expect(twice.saved).toEqual([{ name: 'night', items: [itemOf('z')] }]);
  expect(savedAs(twice, '  ', layout)).toBe(twice);
  expect(layoutOfText(layoutText(layout))).toEqual(layout);
  for (const bad of ['', '{}', '[]', '[7]', 'x']) expect(layoutOfText(bad)).toBeNull();
});

test('limits colour', () => {
  const item = { ...itemOf('a'), low: 1, high: 3 };
  expect([0, 1, 3, 4, null].map((number) => limitTone(item, number))).toEqual([
    ...['danger', 'normal', 'normal', 'danger', 'normal'],
  ]);
});

test('a sparkline needs two points, one a second', () => {
  const history = new ValueHistory();
  history.push('a', 1, 0);
  history.push('a', 9, 500);
  expect(history.line('a', 100, 20)).toBe('');
  history.push('a', 3, 1000);
  history.push('a', null, 2000);
  expect(history.line('a', 100, 20)).toBe('0.0,20.0 100.0,0.0');
});
