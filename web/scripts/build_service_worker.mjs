/**
 * Builds the service worker into dist/sw.js, with the list of what it keeps. Run after the console was built: the list
 * and the version are those of the files that are there.
 */

import { createHash } from 'node:crypto';
import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';

import { build } from 'vite';

const web = join(dirname(fileURLToPath(import.meta.url)), '..');
const built = join(web, 'dist');

// Fonts of other alphabets come when a name needs them; icons are the system's business.
const KEPT = [/^index\.html$/, /^assets\/.*\.(js|css)$/, /^assets\/inter-latin-wght.*\.woff2$/, /^basemap\//];
const SIGN = /^icon\.svg$/;
/** Catalogues of languages: each is fetched, and kept, by those who read it (service_worker/worker.ts). */
const LANGUAGE = /^assets\/portuguese(_labels)?-/;

const files = readdirSync(built, { recursive: true, withFileTypes: true })
  .filter((entry) => entry.isFile() && !/\.(br|gz)$/.test(entry.name))
  .map((entry) => relative(built, join(entry.parentPath, entry.name)).replaceAll('\\', '/'))
  .filter((path) => [...KEPT, SIGN].some((pattern) => pattern.test(path)) && !LANGUAGE.test(path))
  .sort();
const version = createHash('sha256');
for (const path of files)
  version
    .update(path)
    .update('\0')
    .update(readFileSync(join(built, path)));
const entry = /<script type="module"[^>]* src="\.\/(assets\/[^"]+)"/.exec(
  readFileSync(join(built, 'index.html'), 'utf8'),
)?.[1];
if (!entry || !files.includes(entry)) throw new Error('dist/index.html names no script of ours: was it built?');

await build({
  root: web,
  configFile: false,
  logLevel: 'warn',
  define: {
    __VERSION__: JSON.stringify(version.digest('hex').slice(0, 16)),
    __ENTRY__: JSON.stringify(entry),
    __FILES__: JSON.stringify(files),
  },
  build: {
    target: 'es2023',
    outDir: built,
    emptyOutDir: false,
    copyPublicDir: false,
    lib: {
      entry: join(web, 'service_worker', 'worker.ts'),
      formats: ['iife'],
      name: 'serviceWorker',
      fileName: () => 'sw.js',
    },
  },
});
console.log(`service worker: keeps ${files.length} files`);
