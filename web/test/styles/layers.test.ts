import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { describe, expect, it } from 'vitest';

const SOURCES = fileURLToPath(new URL('../../src', import.meta.url));
const TOKENS = join(SOURCES, 'styles', 'tokens.css');
const files = readdirSync(SOURCES, { recursive: true, encoding: 'utf8' })
  .filter((name) => /\.(svelte|css)$/.test(name))
  .map((name) => join(SOURCES, name));
const tokens = new Set(readFileSync(TOKENS, 'utf8').match(/--layer-[\w-]+(?=:)/g));

describe('what lies over what', () => {
  it('is decided in one file: two parts that name numbers of their own cover each other', () => {
    const found = files.flatMap((file) =>
      [...readFileSync(file, 'utf8').matchAll(/z-index:\s*([^;]+);/g)]
        .map(([, value = '']) => value.replace(' !important', ''))
        .filter((value) => !tokens.has(/^var\((--layer-[\w-]+)\)$/.exec(value)?.[1] ?? ''))
        .map((value) => `${file.slice(SOURCES.length + 1)}: ${value}`),
    );
    expect(files.length).toBeGreaterThan(100);
    expect(found).toEqual([]);
  });
});
