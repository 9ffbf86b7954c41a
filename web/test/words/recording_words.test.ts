import { expect, it } from 'vitest';

import type { Recording } from '../../src/link/recordings';
import {
  deleteQuestion,
  flightWords,
  lengthWords,
  playTime,
  recordingBlocked,
  recordingState,
} from '../../src/words/recording_words';
import { A_DRONE } from '../link/fakes';

const recording: Recording = {
  id: 3,
  drone_id: 1,
  by: { id: 5, name: 'alice' },
  state: 'ready',
  words: '',
  quality: 'medium',
  codec: 'h264',
  began_at: '2026-11-22T09:00:00Z',
  first_picture_at: null,
  ended_at: '2026-11-22T09:01:05Z',
  flights: [],
  size_bytes: 100,
  duration_s: 64.6,
  pictures: 0,
  width: null,
  height: null,
};

it('says how long a video plays', () => {
  const table: [number | null, string][] = [
    [null, '–'],
    [-1, '0:00'],
    [7.4, '0:07'],
    [64.6, '1:05'],
    [3_723, '1:02:03'],
  ];
  for (const [seconds, words] of table) expect(playTime(seconds)).toBe(words);
});

it('counts while it goes on, and says the length of the file when it is there', () => {
  const nowMs = Date.parse('2026-11-22T09:02:00Z');
  expect(lengthWords({ ...recording, state: 'recording', duration_s: null }, nowMs)).toBe('2:00');
  expect(lengthWords({ ...recording, state: 'finishing', duration_s: null }, nowMs)).toBe('–');
  expect(lengthWords(recording, nowMs)).toBe('1:05');
});

it('says what became of it and why', () => {
  expect(recordingState(recording)).toBe('Ready');
  expect(recordingState({ ...recording, words: 'the tower was stopped' })).toBe('Ready: the tower was stopped');
  expect(recordingState({ ...recording, state: 'failed', words: 'no picture came' })).toBe('Failed: no picture came');
  expect(recordingState({ ...recording, state: 'new-state' as Recording['state'] })).toBe('new-state');
});

it('says which flights it shows', () => {
  const flights = ['2026-11-22T08:59:00Z', '2026-11-22T09:00:30Z'];
  expect(flightWords(recording)).toBe('–');
  expect(flightWords({ ...recording, flights: flights.slice(0, 1) })).toBe('2026-11-22 08:59:00');
  expect(flightWords({ ...recording, flights })).toBe('2026-11-22 08:59:00 and 1 more');
});

it('says why somebody may not record', () => {
  const drone = { ...A_DRONE, holder: { id: 5, name: 'alice' } };
  const alice = { id: 5, name: 'alice', role: 'operator' as const };
  const bob = { id: 6, name: 'bob', role: 'operator' as const };
  expect(recordingBlocked(drone, alice, true)).toBe('');
  expect(recordingBlocked(drone, { ...bob, role: 'admin' }, true)).toBe('');
  expect(recordingBlocked(drone, alice, false)).toContain('connection');
  expect(recordingBlocked(drone, bob, true)).toContain(drone.name);
  expect(recordingBlocked({ ...drone, may_watch_video: false }, alice, true)).toContain(drone.name);
});

it('names the drone and the time before a recording is deleted', () => {
  const { title, text, isDanger } = deleteQuestion('hawk', recording);
  expect(title).toContain('hawk');
  expect(text).toContain('hawk');
  expect(text).toContain('2026-11-22 09:00:00 UTC');
  expect(isDanger).toBe(true);
});
