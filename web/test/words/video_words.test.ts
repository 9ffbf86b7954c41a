import { describe, expect, it } from 'vitest';

import type { VideoState, VideoStats, VideoStatus } from '../../src/video/video_types';
import {
  delayWords,
  isLate,
  missedWords,
  rateWords,
  snapshotWords,
  videoTaken,
  videoWords,
} from '../../src/words/video_words';

const AT = Date.UTC(2026, 2, 4, 5, 6, 7);
const status = (state: VideoState, words = ''): VideoStatus => ({
  state,
  words,
  codecs: [],
  quality: 'low',
  codec: 'mpeg1',
  sinceMs: AT,
  retryAtMs: state === 'cut-off' ? AT + 2_500 : null,
});
const stats = (more: Partial<VideoStats> = {}): VideoStats => ({
  delayMs: 80,
  worstDelayMs: 90,
  stillMs: 20,
  rateHz: 24,
  bitsPerS: 410_000,
  lost: 0,
  skipped: 0,
  decodeMs: 2,
  width: 320,
  height: 240,
  ...more,
});
const say = (state: VideoState, words = '', figures: VideoStats | null = stats()): string => {
  const said = videoWords('Heron', status(state, words), figures, AT);
  return said ? `${said.title} ${said.detail}`.trim() : '';
};

describe('what is wrong with the video', () => {
  const STATES: VideoState[] = ['connecting', 'waiting', 'no-camera', 'camera-lost', 'offline', 'thin-link'];
  STATES.push('no-agent-video', 'cut-off', 'refused', 'paused', 'unplayable');

  it.each(STATES)('names the drone: %s', (state) => {
    expect(say(state)).toContain('Heron');
  });

  it('says nothing while the picture is live, and tells an old picture from a live one', () => {
    expect(say('live')).toBe('');
    expect(say('live', '', stats({ stillMs: 3_100 }))).toBe('No new picture of Heron for 3 s. What is shown is old.');
    expect(say('live', '', stats({ stillMs: null }))).toBe('Waiting for the first picture of Heron…');
    expect(say('live', '', null)).toBe('Waiting for the first picture of Heron…');
  });

  it('says once that the drone is offline', () => {
    expect(say('offline', 'Heron is offline.')).toBe('Heron is offline.');
    expect(say('offline', 'The tower restarts.')).toBe('Heron is offline. The tower restarts.');
  });

  it('says since when the camera is lost, and what the tower knows of it', () => {
    expect(say('camera-lost', 'USB is gone.')).toBe('Camera of Heron lost since 05:06:07 UTC. USB is gone.');
  });

  it('counts down to the next try', () => {
    expect(say('cut-off')).toBe('The connection to the tower is lost: no video of Heron. Next try in 3 s.');
  });
});

describe('the figures in words', () => {
  it.each([
    [{}, '80 ms', false],
    [{ delayMs: 501 }, '501 ms', true],
    [{ delayMs: 500 }, '500 ms', false],
    [{ delayMs: null }, 'delay –', false],
    [{ stillMs: 1_240 }, '1.2 s old', true],
    [{ stillMs: null }, '–', false],
  ] as const)('%j', (more, words, late) => {
    expect(delayWords(stats(more))).toBe(words);
    expect(isLate(stats(more))).toBe(late);
  });

  it('are never younger than now', () => {
    expect(delayWords(stats({ delayMs: -2.4 }))).toBe('0 ms');
  });

  it('are of the right size', () => {
    expect(rateWords(409_600)).toBe('410 kbit/s');
    expect(rateWords(1_520_000)).toBe('1.5 Mbit/s');
    expect(missedWords(stats({ lost: 3 }))).toBe('lost 3');
    expect(missedWords(stats({ lost: 3, skipped: 12 }))).toBe('lost 3, skipped 12');
    expect(isLate(null)).toBe(false);
  });

  it('a saved picture says whose it is and when it was', () => {
    expect(snapshotWords('Heron 2', AT)).toBe('Heron 2 2026-03-04T05-06-07Z');
  });

  it('a video that was taken is said to be whose, and by whom', () => {
    const holder = { id: 2, name: 'root' };
    expect(videoTaken({ name: 'Heron', holder })).toMatchObject({ title: expect.stringContaining('Heron') as string });
    expect(videoTaken({ name: 'Heron', holder }).detail).toContain('root took control');
    expect(videoTaken({ name: 'Heron', holder: null }).detail).toContain('An admin took control');
  });
});
