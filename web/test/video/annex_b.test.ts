import { describe, expect, it } from 'vitest';

import { codecString } from '../../src/video/annex_b';
import { goldenUnits } from './golden_units';

const NAL = [0, 0, 0, 1];
const unit = (...parts: number[][]): Uint8Array => Uint8Array.from(parts.flat());

describe('the codec string', () => {
  it('is in the key pictures of the agent, and in no other', () => {
    for (const { unit: golden } of goldenUnits('h264')) {
      const codec = codecString(golden.payload);
      if (golden.isKey) expect(codec).toMatch(/^avc1\.[0-9A-F]{6}$/);
      else expect(codec).toBeNull();
    }
  });

  it.each([
    ['baseline', [0x42, 0xc0, 0x1e], 'avc1.42C01E'],
    ['high', [0x64, 0x00, 0x0a], 'avc1.64000A'],
  ])('of %s', (_, profile, codec) => {
    expect(codecString(unit(NAL, [0x67, ...profile, 1, 2], NAL, [0x68, 3], NAL, [0x65, 4]))).toBe(codec);
    expect(codecString(unit([0, 0, 1, 0x67, ...profile, 1]))).toBe(codec);
  });

  it('is found behind a delimiter and a message', () => {
    expect(codecString(unit(NAL, [9, 0xf0], NAL, [6, 1, 0, 0, 3, 0], NAL, [0x27, 0x4d, 0x40, 0x1f, 9, 9]))).toBe(
      'avc1.4D401F',
    );
  });

  it('is not looked for in the picture, nor in what ends too soon', () => {
    expect(codecString(unit(NAL, [0x41, 1, 2, 3], NAL, [0x67, 0x42, 0xc0, 0x1e, 1]))).toBeNull();
    expect(codecString(unit(NAL, [0x67, 0x42]))).toBeNull();
    expect(codecString(new Uint8Array())).toBeNull();
  });
});
