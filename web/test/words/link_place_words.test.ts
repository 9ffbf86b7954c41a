import { expect, it } from 'vitest';

import { gradeRanges, type LinkPlace } from '../../src/link/link_places';
import { cellWords, measureWords, placeGradeWords, rangeWords } from '../../src/words/link_place_words';

it('says the figures with their units', () => {
  expect(measureWords('loss', 4.25)).toBe('4.3 %');
  expect(measureWords('latency', 180.4)).toBe('180 ms');
  expect(measureWords('loss', null)).toBe('–');
});

it('says the range of each grade', () => {
  expect(gradeRanges('loss').map((range) => rangeWords('loss', range))).toEqual([
    'up to 2 %',
    '2 to 8 %',
    '8 to 20 %',
    'over 20 %',
  ]);
  expect(gradeRanges('latency').map((range) => rangeWords('latency', range))).toEqual([
    'up to 150 ms',
    '150 to 300 ms',
    '300 to 500 ms',
    'over 500 ms',
  ]);
});

it('writes whole numbers into a cell, and nothing where nothing was measured', () => {
  const place = { lossPercent: 12.6, rttMs: null } as LinkPlace;
  expect([cellWords('loss', place), cellWords('latency', place)]).toEqual(['13 %', '']);
});

it('grades a place by what the map shows, and says where the link was only lost', () => {
  const place = { lossPercent: 30, rttMs: 60, losses: 0 } as LinkPlace;
  expect(placeGradeWords('loss', place)).toBe('Bad');
  expect(placeGradeWords('latency', place)).toBe('Good');
  const unknown = { ...place, lossPercent: null };
  expect(placeGradeWords('loss', unknown)).toBe('–');
  expect(placeGradeWords('loss', { ...unknown, losses: 1 })).toBe('Link lost');
});
