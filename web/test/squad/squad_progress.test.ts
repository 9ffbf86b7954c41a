import { expect, it } from 'vitest';

import { spotOf } from '../../src/plan/plan_types';
import type { TimedPath, TimedPiece } from '../../src/plan/timed_path';
import { partProgress, squadProgress, type PartFacts } from '../../src/squad/squad_progress';

const spotAt = (northM: number) => spotOf(47 + northM / 111_195, 8);
const piece = (seq: number, fromS: number, toS: number, fromM: number, toM: number): TimedPiece => ({
  seq,
  fromS,
  toS,
  from: spotAt(fromM),
  to: spotAt(toM),
  fromHeightM: 10,
  toHeightM: 10,
  reachM: 0,
});
/** Take-off (0), a leg north (1), a change of speed (2), a leg further north (3). */
const PATH: TimedPath = {
  pieces: [piece(0, 0, 10, 0, 0), piece(1, 10, 50, 0, 200), piece(3, 50, 100, 200, 450)],
  seconds: 100,
  ending: 'end' as TimedPath['ending'],
  staysUp: true,
};
const FLOWN: PartFacts = { path: PATH, current: 1, here: spotAt(100), isFlown: true, isDone: false };

it.each<[string, Partial<PartFacts>, number]>([
  ['in the middle of a leg', {}, 0.3],
  ['at its take-off', { current: 0, here: spotAt(0) }, 0],
  ['on the last leg', { current: 3, here: spotAt(400) }, 0.9],
  ['at an item without a way', { current: 2, here: spotAt(200) }, 0.5],
  ['behind the start of a leg', { here: spotAt(-50) }, 0.1],
  ['without a position', { here: null }, 0.1],
  ['done', { isFlown: false, current: null, isDone: true }, 1],
  ['at an item after the last', { current: 9 }, 1],
])('%s', (_, facts, share) => {
  const progress = partProgress({ ...FLOWN, ...facts });
  expect(progress?.share).toBeCloseTo(share, 2);
  expect(progress?.leftS).toBeCloseTo(100 * (1 - share), 0);
});

it.each<[string, Partial<PartFacts>]>([
  ['on the ground', { isFlown: false }],
  ['that does not say where it is in its mission', { current: null }],
])('nothing is known of a drone %s', (_, facts) => {
  expect(partProgress({ ...FLOWN, ...facts })).toBeNull();
});

it('of the squad is by time, and ends with its last drone', () => {
  const parts = [
    { seconds: 100, progress: { share: 1, leftS: 0 } },
    { seconds: 100, progress: { share: 0.5, leftS: 50 } },
    { seconds: 200, progress: null },
  ];
  expect(squadProgress(parts)).toEqual({ share: 150 / 400, leftS: 200, flying: 1 });
  expect(squadProgress(parts.slice(0, 2))).toEqual({ share: 0.75, leftS: 50, flying: 1 });
  expect(squadProgress([{ seconds: 9, progress: null }])).toBeNull();
  expect(squadProgress([])).toBeNull();
});
