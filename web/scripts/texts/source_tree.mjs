/** The source of the console as ESTree with positions: TypeScript and Svelte alike. */

import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';

import { parse as parseTypeScript } from '@typescript-eslint/parser';
import { parse as parseSvelte } from 'svelte/compiler';

export const SOURCE = join(dirname(fileURLToPath(import.meta.url)), '..', '..', 'src');
/** Generated from other sources, or read by machines only. */
const LEFT_OUT = [/^link\/generated\//, /^parameters\/facts\//, /^languages\//, /\.d\.ts$/];

/** The files that may hold texts, as paths relative to `src/`, sorted. */
export function sourceFiles() {
  return readdirSync(SOURCE, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile() && /\.(ts|svelte)$/.test(entry.name))
    .map((entry) => relative(SOURCE, join(entry.parentPath, entry.name)).replaceAll('\\', '/'))
    .filter((path) => !LEFT_OUT.some((pattern) => pattern.test(path)))
    .sort();
}

export const readSource = (path) => readFileSync(join(SOURCE, path), 'utf8');

/** The trees of one file: script, module script and markup of a Svelte file, or the one program. */
export function treesOf(path, code) {
  if (!path.endsWith('.svelte')) return [parseTypeScript(code, { range: true, loc: false, sourceType: 'module' })];
  const { instance, module, fragment } = parseSvelte(code, { modern: true, filename: path });
  return [module?.content, instance?.content, fragment].filter(Boolean);
}

export const startOf = (node) => node.range?.[0] ?? node.start;
export const endOf = (node) => node.range?.[1] ?? node.end;
export const lineAt = (code, at) => code.slice(0, at).split('\n').length;

const NOT_CHILDREN = new Set(['parent', 'loc', 'range', 'metadata', 'leadingComments', 'trailingComments', 'comments']);
const isNode = (value) => typeof value === 'object' && value !== null && typeof value.type === 'string';

/** Calls `visit(node, ancestors)` from the root down, nearest ancestor last. False: leaves the children out. */
export function walk(node, visit, ancestors = []) {
  if (visit(node, ancestors) === false) return;
  const inner = [...ancestors, node];
  for (const [key, value] of Object.entries(node)) {
    if (NOT_CHILDREN.has(key)) continue;
    for (const child of Array.isArray(value) ? value : [value]) if (isNode(child)) walk(child, visit, inner);
  }
}
