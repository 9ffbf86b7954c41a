import { expect, it } from 'vitest';

import { whyNoLogs } from '../../src/words/log_words';

const SITUATION = { name: 'Heron', online: true, isConnected: true, isAirborne: false, isBusy: false };

it.each([
  [{}, ''],
  [{ isAirborne: null }, ''],
  [{ isConnected: false, online: false }, 'No connection to the tower.'],
  [{ online: false }, 'Heron is offline.'],
  [{ isAirborne: true, isBusy: true }, 'Heron is in the air: its logs are read on the ground.'],
  [{ isBusy: true }, 'Heron is sending logs: it does one thing at a time.'],
])('says why an autopilot cannot be asked for logs: %o', (changes, words) => {
  expect(whyNoLogs({ ...SITUATION, ...changes })).toBe(words);
});
