import { expect, it } from 'vitest';

import type { Flight } from '../../src/link/flights';
import { flightLength, flightNote, pilotWords } from '../../src/words/flight_words';

const A_FLIGHT: Flight = {
  id: 3,
  drone_id: 1,
  drone: 'Kestrel',
  pilots: [{ id: 5, name: 'alice' }],
  state: 'ready',
  words: '',
  began_at: '2026-11-22T09:00:00Z',
  ended_at: '2026-11-22T09:01:05Z',
  duration_s: 64.6,
  distance_m: 1234.5,
  max_height_m: 20,
  track: [],
  frames: 1000,
  lost_frames: 0,
  size_bytes: 100,
};

it('says how long a flight was, or has been so far', () => {
  expect(flightLength(A_FLIGHT, 0)).toBe('1:05');
  const running: Flight = { ...A_FLIGHT, state: 'recording', duration_s: null };
  expect(flightLength(running, Date.parse('2026-11-22T09:00:07Z'))).toBe('0:07');
});

it('names everybody who flew', () => {
  expect(pilotWords(A_FLIGHT)).toBe('alice');
  expect(pilotWords({ ...A_FLIGHT, pilots: [...A_FLIGHT.pilots, { id: null, name: 'bob' }] })).toBe('alice, bob');
  expect(pilotWords({ ...A_FLIGHT, pilots: [] })).toBe('–');
});

it('says what is not as it should be', () => {
  expect(flightNote(A_FLIGHT)).toBe('');
  expect(flightNote({ ...A_FLIGHT, state: 'recording' })).toBe('Is being recorded');
  expect(flightNote({ ...A_FLIGHT, words: 'the tower was stopped' })).toBe('The tower was stopped');
  expect(flightNote({ ...A_FLIGHT, words: "the tower's disk is full", lost_frames: 7 })).toBe(
    "The tower's disk is full; 7 frames are missing",
  );
  expect(flightNote({ ...A_FLIGHT, state: 'failed' })).toBe('Cannot be read');
});
