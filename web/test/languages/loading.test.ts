import { afterEach, beforeEach, expect, it, vi } from 'vitest';

import type * as Languages from '../../src/languages/languages';

const page = { documentElement: { lang: 'en' } };
let stored: string | null;

beforeEach(() => {
  stored = null;
  page.documentElement.lang = 'en';
  vi.stubGlobal('document', page);
  vi.stubGlobal('navigator', { languages: ['pt-BR', 'en'] });
  vi.stubGlobal('localStorage', { getItem: () => stored });
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.doUnmock('../../src/languages/languages');
  vi.doUnmock('../../src/languages/pt/portuguese');
  vi.resetModules();
});

/** What a page has after its start: in which language it is, and "Hold". */
async function started(offered: readonly Languages.Language[]): Promise<[string, string, string]> {
  vi.doMock('../../src/languages/languages', async (original) => {
    const real = await original<typeof Languages>();
    return {
      ...real,
      isLanguageChoice: (value: unknown) => value === 'system' || offered.some((one) => one === value),
      languageFor: (choice: Languages.LanguageChoice, wanted: readonly string[]) =>
        real.languageFor(choice, wanted, offered),
    };
  });
  const { loadLanguage } = await import('../../src/languages/loading');
  const { currentLanguage, t } = await import('../../src/languages/text');
  await loadLanguage();
  return [currentLanguage(), page.documentElement.lang, t('Hold')];
}
const withCatalogue = (): unknown =>
  vi.doMock('../../src/languages/pt/portuguese', () => ({ default: { Hold: 'Parar' }, tower: {} }));

it('starts in the language of the browser, if it is offered', async () => {
  withCatalogue();
  expect(await started(['en', 'pt'])).toEqual(['pt', 'pt', 'Parar']);
});

it('starts in English while the other is not offered', async () => {
  withCatalogue();
  stored = '{"language":"pt"}';
  expect(await started(['en'])).toEqual(['en', 'en', 'Hold']);
});

it('starts in the language that the user chose', async () => {
  withCatalogue();
  stored = '{"language":"en"}';
  expect(await started(['en', 'pt'])).toEqual(['en', 'en', 'Hold']);
});

it('does not mind what else is stored', async () => {
  withCatalogue();
  stored = '{"language":';
  expect(await started(['en', 'pt'])).toEqual(['pt', 'pt', 'Parar']);
});

it('starts in English if the catalogue cannot be loaded', async () => {
  vi.doMock('../../src/languages/pt/portuguese', () => {
    throw new Error('no network');
  });
  expect(await started(['en', 'pt'])).toEqual(['en', 'en', 'Hold']);
});

it('has a catalogue whose files fit together', async () => {
  const { default: catalogue } = await import('../../src/languages/pt/portuguese');
  expect(Object.values(catalogue).every((one) => typeof one === 'string' || typeof one.other === 'string')).toBe(true);
});
