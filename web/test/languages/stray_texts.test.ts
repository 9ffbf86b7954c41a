/** No text for the screen stands outside the catalogue (src/languages/text.ts). */

import { describe, expect, it } from 'vitest';

import { BY_PLACE } from '../../scripts/texts/exceptions.mjs';
import { lineAt, readSource, sourceFiles } from '../../scripts/texts/source_tree.mjs';
import { strayTexts } from '../../scripts/texts/stray_texts.mjs';

const MAX_MS = 240_000;
const files = sourceFiles();
const shownIn = (path: string, code: string): string[] => strayTexts(path, code).map(({ shown }) => shown);

describe('the source of the console', () => {
  it(
    'has no text outside the catalogue',
    () => {
      const strays = files.flatMap((path) => {
        const code = readSource(path);
        return strayTexts(path, code).map(({ start, shown }) => `${path}:${lineAt(code, start)}: ${shown}`);
      });
      expect(strays).toEqual([]);
    },
    MAX_MS,
  );

  it(
    'could hide none in any Svelte file',
    () => {
      const svelte = files.filter((path) => path.endsWith('.svelte'));
      expect(svelte.length).toBeGreaterThan(150);
      const blind = svelte.filter(
        (path) =>
          !shownIn(path, `${readSource(path)}\n<p>Nobody translates this</p>`).includes('Nobody translates this'),
      );
      expect(blind).toEqual([]);
    },
    MAX_MS,
  );

  it('needs each exception', () => {
    const lonely = Object.keys(BY_PLACE).filter((place) => !files.includes(place));
    expect(lonely).toEqual([]);
  });
});

describe('a text outside the catalogue', () => {
  const script = (code: string): string[] => shownIn('parts/Test.svelte', `<script lang="ts">\n${code}\n</script>`);
  const markup = (code: string): string[] => shownIn('parts/Test.svelte', code);

  it.each([
    ['<p>Hold it</p>', 'Hold it'],
    ['<p>{drone.name} is offline.</p>', '{} is offline.'],
    ['<b>{n}</b> drones', 'drones'],
    ["<p>{isOn ? 'on' : 'off'}</p>", 'on'],
    ['{#if isOld}Old{/if}', 'Old'],
    ['<button title="Key F">{name}</button>', 'Key F'],
    ['<input placeholder={`Search ${name}`} />', 'Search {}'],
    ['<Field label="Height" />', 'Height'],
    ["<Field hint={isNew ? '' : 'as before'} />", 'as before'],
    ["<button onclick={() => say('Saved.')}>{name}</button>", 'Saved.'],
  ])('is found in %s', (code, shown) => {
    expect(markup(code)).toContain(shown);
  });

  it.each([
    ["const label = 'Release';", 'Release'],
    ["const WORDS = { lost: 'lost', on: 'on' };", 'lost'],
    ["function stateWords() { return isOld ? 'old' : ''; }", 'old'],
    ["notes.push('its link is down');", 'its link is down'],
    ['throw new Error(`The tower answered ${status}.`);', 'The tower answered {}.'],
    ["const end = isLast ? ', paused' : '';", ', paused'],
    ["t('Hold {name}', { name: name || 'the drone' });", 'the drone'],
    ["const SEVERITIES = { critical: t('critical only'), warning: t('warnings'), notice: 'all' };", 'all'],
    ["const LASTS = [['1', t('One day')], ['30', '30 days']];", '30 days'],
  ])('is found in %s', (code, shown) => {
    expect(script(code)).toContain(shown);
  });

  it.each([
    "t('Hold {name}', { name });",
    "plural(n, { one: '{n} drone', other: '{n} drones' });",
    "if (phase === 'open') tower.rest.call('GET', '/drones/{drone_id}');",
    'const part = document.querySelector(\'[role="dialog"] button\');',
    "import { Drone } from './Some words';",
    "type Choice = 'on the drone' | 'nowhere at all';",
    "const unit = { symbol: 'm/s' };",
    "const EDGES = [['north', t('North')], ['south', t('South')]];",
    "const filter = { value: 'all', label: t('All'), title: t('All of them') };",
  ])('is not seen in %s', (code) => {
    expect(script(code)).toEqual([]);
  });

  it.each([
    '<p class="button small" data-testid="some words">{value} m/s</p>',
    '<code>tower connect</code>',
    "<p>{t('Hold it')}</p>",
    '<p>{name}: 100 %</p>',
  ])('is not seen in %s', (code) => {
    expect(markup(code)).toEqual([]);
  });
});
