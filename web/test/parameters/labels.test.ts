import { afterEach, expect, it } from 'vitest';

import LABELS from '../../src/languages/pt/parameters/portuguese_labels.json';
import { useCatalogue } from '../../src/languages/text';
import { WORDS } from '../../src/parameters/abbreviations';
import { factOf, readFacts, type Labels } from '../../src/parameters/facts';
import { ARDUCOPTER_SETUP } from '../../src/parameters/facts/arducopter_setup';
import { ARDUCOPTER_WORDS } from '../../src/parameters/facts/arducopter_words';
import { PX4_SETUP } from '../../src/parameters/facts/px4_setup';
import { PX4_WORDS } from '../../src/parameters/facts/px4_words';
import { loadFacts, loadSetup } from '../../src/parameters/load_facts';

const labels: Labels = LABELS;
const titles = [ARDUCOPTER_WORDS, PX4_WORDS].flatMap((words) =>
  [...readFacts(words).values()].map(({ title }) => title),
);
const groups = [ARDUCOPTER_SETUP, PX4_SETUP].flatMap((setup) =>
  Object.values(setup).flatMap((page) => page.map(([title]) => title)),
);
const needed = new Set([...[...titles, ...groups].flatMap((title) => title.split(': ')), ...Object.values(WORDS)]);

afterEach(() => useCatalogue('en', null));

it('every title of a parameter has a Portuguese one, and nothing else has', () => {
  expect(needed.size).toBeGreaterThan(900);
  expect([...needed].filter((part) => !labels[part])).toEqual([]);
  expect(Object.keys(labels).filter((part) => !needed.has(part))).toEqual([]);
});

it('a title keeps its number and what replaces its star', () => {
  const holes = (text: string): string => text.replace(/[^#*]/g, '');
  expect(Object.entries(labels).filter(([part, label]) => holes(part) !== holes(label))).toEqual([]);
});

it('a reader of Portuguese sees the titles in it, with numbers and the words of a family', async () => {
  useCatalogue('pt', {});
  const facts = await loadFacts('ardupilot');
  const title = (name: string): string => factOf(facts, name)?.title ?? '';
  expect(title('COMPASS_OPTIONS')).toBe('Opções da bússola');
  expect(title('SERVO3_FUNCTION')).toBe('A saída 3 comanda');
  expect(title('ATC_RAT_RLL_FLTD')).toBe('Velocidade de rolamento: filtro de D');
  expect(title('BATT2_CAPACITY')).toBe('Capacidade (2)');
  const px4 = await loadFacts('px4');
  expect(factOf(px4, 'MPC_XY_VEL_MAX')?.title).toBe('Velocidade máxima');
  expect((await loadSetup('ardupilot'))?.frame.map(([group]) => group)).toEqual(['Estrutura', 'Motores', 'Placa']);
});

it('a reader of English sees them as they are written', async () => {
  const facts = await loadFacts('ardupilot');
  expect(factOf(facts, 'COMPASS_OPTIONS')?.title).toBe('Compass options');
  expect((await loadSetup('px4'))?.frame.map(([group]) => group)).toEqual(['Frame', 'Motors', 'Board']);
});
