/** How the console's unit tests run. */

import { readdirSync, readFileSync } from 'node:fs';

import { defineConfig, mergeConfig } from 'vitest/config';

import console from './vite.config.ts';

/** What changes modules, globals or the language for all that run in the same worker. */
const CHANGES_WORKER = /\bvi\.(?!fn\b|useFakeTimers\b|useRealTimers\b|advance)|languages\/|\bglobalThis\b/;

const files = readdirSync('test', { recursive: true, encoding: 'utf8' })
  .filter((file) => file.endsWith('.test.ts'))
  .map((file) => `test/${file}`);
const alone = files.filter((file) => CHANGES_WORKER.test(readFileSync(file, 'utf8')));

export default mergeConfig(
  console,
  defineConfig({
    test: {
      // A worker of its own for each file loads the same modules again: that took most of the time.
      projects: [
        { extends: true, test: { name: 'shared', include: ['test/**/*.test.ts'], exclude: alone, isolate: false } },
        { extends: true, test: { name: 'alone', include: alone } },
      ],
      environment: 'node',
      setupFiles: ['test/examples.ts'],
      // A property tries hundreds of examples; five seconds are few for that on a busy machine.
      testTimeout: 30_000,
    },
  }),
);
