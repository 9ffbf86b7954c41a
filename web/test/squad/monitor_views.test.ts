import { describe, expect, it } from 'vitest';

import {
  isSameChoice,
  MAX_NAME_LENGTH,
  MAX_VIEWS,
  readViews,
  removed,
  saved,
  USUAL_LIST,
  whyNotSave,
  type ListChoice,
  type SavedViews,
} from '../../src/squad/monitor_views';

const NONE: SavedViews = { views: [], first: null };
const FLYING: ListChoice = {
  view: 'table',
  search: 'kes',
  filter: 'flying',
  order: { key: 'battery', isDescending: true },
};
const full = Array.from({ length: MAX_VIEWS }, (_, at) => `view ${at}`).reduce(
  (views, name) => saved(views, name, USUAL_LIST),
  NONE,
);

describe('views of the Monitor', () => {
  it('come back from the tower as they were saved', () => {
    const views = { ...saved(saved(NONE, 'night', USUAL_LIST), 'in the air', FLYING), first: 'night' };
    expect(readViews(JSON.parse(JSON.stringify(views)))).toEqual(views);
  });

  it.each([undefined, null, 7, [], { views: 'none' }, { views: [null, { name: '' }, { name: 3 }], first: 'gone' }])(
    'are none in %j',
    (document) => {
      expect(readViews(document)).toEqual(NONE);
    },
  );

  it('have the usual for what is unknown', () => {
    const read = readViews({ views: [{ name: 'old', view: 'globe', filter: 'lost', order: { key: 'smell' } }] });
    expect(read.views).toEqual([{ name: 'old', ...USUAL_LIST }]);
  });

  it('of the same name are replaced, in their place', () => {
    const views = saved(saved(saved(NONE, 'a', USUAL_LIST), 'b', USUAL_LIST), 'a', FLYING);
    expect(views.views.map(({ name, view }) => [name, view])).toEqual([
      ['a', 'table'],
      ['b', 'cards'],
    ]);
  });

  it('that are removed do not open the Monitor', () => {
    const views = { ...saved(NONE, 'a', FLYING), first: 'a' };
    expect(removed(views, 'a')).toEqual(NONE);
    expect(removed(views, 'b')).toEqual(views);
  });

  it.each([
    ['', NONE, 'Give it a name.'],
    ['  ', NONE, 'Give it a name.'],
    ['x'.repeat(MAX_NAME_LENGTH + 1), NONE, `A name has ${MAX_NAME_LENGTH} letters at most.`],
    ['one more', full, `You have ${MAX_VIEWS} views. Remove one first.`],
    ['view 3', full, ''],
    ['night', NONE, ''],
  ])('named "%s" are refused with the reason, or not', (name, views, why) => {
    expect(whyNotSave(views, name)).toBe(why);
  });

  it('are compared by what they show', () => {
    expect(isSameChoice(FLYING, { ...FLYING })).toBe(true);
    expect(isSameChoice(FLYING, { ...FLYING, order: { key: 'battery', isDescending: false } })).toBe(false);
    expect(isSameChoice(FLYING, USUAL_LIST)).toBe(false);
  });

  it('fit the document of the tower when all are as long as they can be', () => {
    const longest = { ...FLYING, search: 'ü'.repeat(100) };
    const views = Array.from({ length: MAX_VIEWS }, (_, at) => `${at}`.padEnd(MAX_NAME_LENGTH, 'ü')).reduce(
      (all, name) => saved(all, name, longest),
      NONE,
    );
    expect(new TextEncoder().encode(JSON.stringify(views)).length).toBeLessThan(8 * 1024);
  });
});
