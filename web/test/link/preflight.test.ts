import { expect, test } from 'vitest';

import { linesIn, openWords, worstState, type LineState } from '../../src/link/preflight';

const lines = (...states: LineState[]) => ({
  lines: states.map((state, at) => ({ key: `k${at}`, title: 'T', state, words: 'W' })),
});

test('the worst line decides', () => {
  expect(worstState(lines('good', 'caution', 'bad'))).toBe('bad');
  expect(worstState(lines('good', 'unknown', 'caution'))).toBe('caution');
  expect(worstState(lines('good', 'unknown'))).toBe('unknown');
  expect(worstState(lines('good'))).toBe('good');
});

test('what is open is counted in words', () => {
  expect(openWords(lines('bad', 'caution', 'unknown', 'good'))).toBe('2 not OK, 1 not known');
  expect(openWords(lines('good'))).toBe('');
});

test('own lines are typed one below the other', () => {
  expect(linesIn('  Propellers   tight \n\n Battery latched\n')).toEqual(['Propellers tight', 'Battery latched']);
});
