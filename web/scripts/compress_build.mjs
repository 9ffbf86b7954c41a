/**
 * Puts a Brotli and a gzip copy beside every text file of the build that gets smaller by it. The tower serves the
 * smallest copy a browser takes (server/http/console.py), so that nothing is compressed while somebody waits.
 */

import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';

const built = join(dirname(fileURLToPath(import.meta.url)), '..', 'dist');
const TEXT = new Set(['.css', '.html', '.js', '.json', '.svg', '.wasm', '.webmanifest']);
const WORTH_IT_BYTES = 256; // less than this saved is less than the headers of the answer

const brotli = (bytes) =>
  brotliCompressSync(bytes, {
    params: {
      [constants.BROTLI_PARAM_QUALITY]: constants.BROTLI_MAX_QUALITY,
      [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length,
    },
  });

let before = 0;
let after = 0;
for (const entry of readdirSync(built, { recursive: true, withFileTypes: true })) {
  if (!entry.isFile() || !TEXT.has(extname(entry.name))) continue;
  const file = join(entry.parentPath, entry.name);
  const plain = readFileSync(file);
  const copies = { br: brotli(plain), gz: gzipSync(plain, { level: 9 }) };
  for (const [ending, bytes] of Object.entries(copies)) {
    if (bytes.length + WORTH_IT_BYTES < plain.length) writeFileSync(`${file}.${ending}`, bytes);
  }
  before += plain.length;
  after += Math.min(plain.length, copies.br.length);
}
console.log(`compressed: ${(before / 1024).toFixed(0)} kB of text are ${(after / 1024).toFixed(0)} kB by Brotli`);
