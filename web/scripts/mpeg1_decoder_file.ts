/**
 * The MPEG-1 decoder of JSMpeg as a file of its own. Its package brings it as text inside a player for pages, which
 * cannot run in a worker and would be fetched whole; we take the decoder alone, and src/video/mpeg1_decoder.ts drives it.
 */

import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';

import JSMpeg from '@cycjimmy/jsmpeg-player';
import type { Plugin } from 'vite';

const NAME = 'virtual:mpeg1-decoder';
const RESOLVED = `\0${NAME}`;

const AUTHORS = `mpeg1-*.wasm is the decoder of JSMpeg, https://github.com/phoboslab/jsmpeg
Copyright (c) 2017 Dominic Szablewski, MIT License,
as built into @cycjimmy/jsmpeg-player, https://github.com/cycjimmy/jsmpeg-player:

`;

const licence = (): string => {
  const main = createRequire(import.meta.url).resolve('@cycjimmy/jsmpeg-player');
  return AUTHORS + readFileSync(join(dirname(main), '..', 'LICENSE'), 'utf8');
};

/** What is imported from `virtual:mpeg1-decoder` is its address. */
export function mpeg1DecoderFile(): Plugin {
  let isBuild = false;
  return {
    name: 'mpeg1-decoder-file',
    configResolved: ({ command }) => {
      isBuild = command === 'build';
    },
    resolveId: (id) => (id === NAME ? RESOLVED : null),
    load(id) {
      if (id !== RESOLVED) return null;
      const base64 = JSMpeg.WASM_BINARY_INLINED;
      if (!isBuild) return `export default 'data:application/wasm;base64,${base64}';`;
      const file = this.emitFile({ type: 'asset', name: 'mpeg1.wasm', source: Buffer.from(base64, 'base64') });
      this.emitFile({ type: 'asset', fileName: 'assets/mpeg1-licence.txt', source: licence() });
      return `export default import.meta.ROLLUP_FILE_URL_${file};`;
    },
  };
}
