/** How the console is built and served while developing. */

import { svelte } from '@sveltejs/vite-plugin-svelte';
import { defineConfig, type HtmlTagDescriptor, type Plugin } from 'vite';

import { mpeg1DecoderFile } from './scripts/mpeg1_decoder_file.ts';

const tower = `http://127.0.0.1:${process.env['TOWER_PORT'] ?? 8000}`;

/**
 * Has the page fetch the way in and the console's own part beside the script that looks for the language, instead of
 * after it: on a far link each step that waits for another costs a round trip. What the map needs is left out; it is
 * large, and comes when the list can be read.
 */
function fetchConsoleEarly(): Plugin {
  return {
    name: 'fetch-console-early',
    transformIndexHtml: {
      order: 'post',
      handler(_html, { bundle }) {
        const files = Object.values(bundle ?? {});
        const chunkOf = (match: (one: { name: string; fileName: string }) => boolean) =>
          files.find((one) => one.type === 'chunk' && match(one));
        const start = chunkOf(({ name }) => name === 'start_console');
        const part = chunkOf(({ name }) => name === 'Console');
        if (start?.type !== 'chunk' || part?.type !== 'chunk') return [];
        for (const entry of files) {
          if (entry.type !== 'chunk' || !entry.isEntry) continue;
          const early = [entry.fileName, ...entry.imports].map((name) => chunkOf(({ fileName }) => fileName === name));
          const modules = early.flatMap((one) => (one?.type === 'chunk' ? one.moduleIds : []));
          const withTexts = modules.find((id) => /\/src\/(?!main\.ts|languages\/|styles\/)/.test(id));
          if (withTexts) throw new Error(`${withTexts} runs before the catalogue of the language is there`);
        }
        const tags: HtmlTagDescriptor[] = [];
        const add = (attrs: Record<string, string | boolean>): void => {
          tags.push({ tag: 'link', attrs: { crossorigin: true, ...attrs }, injectTo: 'head' });
        };
        for (const fileName of new Set([start, part].flatMap((one) => [one.fileName, ...one.imports]))) {
          const chunk = chunkOf((one) => one.fileName === fileName);
          if (chunk?.type !== 'chunk' || chunk.isEntry) continue;
          add({ rel: 'modulepreload', href: `./${fileName}` });
          for (const sheet of chunk.viteMetadata?.importedCss ?? []) {
            add({ rel: 'preload', as: 'style', href: `./${sheet}` });
          }
        }
        // Who it is, asked before there is a script to ask: link/rest.ts takes this very answer.
        tags.push({
          tag: 'link',
          attrs: { rel: 'preload', as: 'fetch', href: '/api/v1/me', crossorigin: 'anonymous' },
          injectTo: 'head',
        });
        return tags;
      },
    },
  };
}

export default defineConfig({
  // Relative addresses: the tower may serve the console below any path.
  base: './',
  plugins: [svelte(), fetchConsoleEarly(), mpeg1DecoderFile()],
  worker: { format: 'es', plugins: () => [mpeg1DecoderFile()] },
  build: {
    target: 'es2023',
    // The content security policy allows no data: fonts or workers.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1200,
    rolldownOptions: {
      output: {
        // What comes together, in one file: each file of its own costs a kilobyte of headers, and a turn on a connection.
        codeSplitting: {
          groups: [
            { name: 'language', test: /src\/languages\/(?!pt\/)/, priority: 5 },
            {
              name: 'common',
              test: /src\/(tower\.svelte|preferences\.svelte|kept_document\.svelte|words\/(units|format|squad_words)|video\/unit|link\/(geometry|unattended))\.ts$/,
              priority: 4,
            },
            { name: 'start_console', test: /src\/start_console\.ts$/, priority: 3 },
            { name: 'Console', test: /src\/Console\.svelte$/, priority: 2 },
            // What loads when the console is idle: the Control page, and what parts/later.ts lists.
            {
              name: 'later',
              test: /src\/(control_actions\.ts|pages\/Control\.svelte|parts\/(ConfirmDialog|DroneCard|JournalList|PairsList|ProofDialog|SquadRowCompact|SquadActionDialog|SquadTable|SearchDialog|HelpSheet|ViewsMenu)\.svelte)$/,
            },
          ],
        },
      },
    },
  },
  server: {
    host: '127.0.0.1',
    port: 5173,
    proxy: {
      // The tower accepts its own origin only, so the proxy speaks as if it were the tower's page.
      '/api': {
        target: tower,
        ws: true,
        changeOrigin: true,
        headers: { origin: tower },
      },
    },
  },
});
