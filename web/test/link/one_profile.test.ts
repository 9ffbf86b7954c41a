import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';

import { expect, test } from 'vitest';

const SRC = join(import.meta.dirname, '../../src');
/** The two readers of heartbeats, the profiles, and the header of a QGroundControl file. */
const MAY_KNOW = new Set(['link/telemetry.ts', 'link/modes.ts', 'plan/formats/qgc_plan.ts', 'replay/overview.ts']);

test('autopilots are told apart by their profiles alone', () => {
  const files = readdirSync(SRC, { recursive: true, encoding: 'utf8' }).filter(
    (name) => /\.(ts|svelte)$/.test(name) && !name.includes('generated'),
  );
  expect(files.length).toBeGreaterThan(100);
  const found = files.filter((name) => readFileSync(join(SRC, name), 'utf8').includes('MAV_AUTOPILOT'));
  expect(found.filter((name) => !MAY_KNOW.has(name))).toEqual([]);
});
