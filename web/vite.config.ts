/** How the console is built, served while developing, and tested. */

import { svelte } from '@sveltejs/vite-plugin-svelte';
import { defineConfig } from 'vitest/config';

const tower = `http://127.0.0.1:${process.env['TOWER_PORT'] ?? 8000}`;

export default defineConfig({
  // Relative addresses: the tower may serve the console below any path.
  base: './',
  plugins: [svelte()],
  build: {
    target: 'es2023',
    // The content security policy allows no data: fonts or workers.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1200,
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
  test: {
    include: ['test/**/*.test.ts'],
    environment: 'node',
  },
});
