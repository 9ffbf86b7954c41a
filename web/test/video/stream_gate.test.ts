import { beforeEach, describe, expect, it } from 'vitest';

import { StreamGate } from '../../src/video/stream_gate';
import type { Unit } from '../../src/video/unit';

let gate: StreamGate;
type Head = Parameters<StreamGate['admits']>[0];
const head = (sequence: number, isKey = false, more: Partial<Unit> = {}): Head => ({
  quality: 'medium',
  codec: 'mpeg1',
  sequence,
  isKey,
  isBreak: false,
  ...more,
});
const admits = (...heads: Head[]): boolean[] => heads.map((one) => gate.admits(one));

beforeEach(() => {
  gate = new StreamGate();
});

describe('what is decoded', () => {
  it('begins with a key picture', () => {
    expect(admits(head(5), head(6), head(7, true), head(8))).toEqual([false, false, true, true]);
    expect(gate.lost).toBe(0);
  });

  it('waits for a key picture after a gap, and counts what is missing', () => {
    expect(admits(head(1, true), head(2), head(5), head(6), head(7, true), head(8))).toEqual([
      true,
      true,
      false,
      false,
      true,
      true,
    ]);
    expect(gate.lost).toBe(2);
  });

  it('needs to wait for nothing when the gap ends with a key picture', () => {
    expect(admits(head(1, true), head(9, true), head(10))).toEqual([true, true, true]);
    expect(gate.lost).toBe(7);
  });

  it('goes on where the count wraps', () => {
    expect(admits(head(2 ** 32 - 1, true), head(0), head(2))).toEqual([true, true, false]);
    expect(gate.lost).toBe(1);
  });

  it('waits after a break', () => {
    expect(admits(head(1, true), head(2, false, { isBreak: true }), head(3), head(4, true, { isBreak: true }))).toEqual(
      [true, false, false, true],
    );
  });

  it('begins again with another stream, which loses nothing', () => {
    expect(admits(head(1, true), head(900, false, { quality: 'high' }), head(901, true, { quality: 'high' }))).toEqual([
      true,
      false,
      true,
    ]);
    expect(admits(head(902, false, { quality: 'high', codec: 'h264' }))).toEqual([false]);
    expect(gate.lost).toBe(0);
  });

  it('a count that begins again, or a unit that comes twice, is no loss', () => {
    expect(admits(head(5000, true), head(0, true), head(0), head(1))).toEqual([true, true, false, false]);
    expect(gate.lost).toBe(0);
  });

  it('waits after another connection, and after what could not be decoded', () => {
    expect(admits(head(1, true))).toEqual([true]);
    gate.shut();
    expect(admits(head(2), head(3, true))).toEqual([false, true]);
    gate.restart();
    expect(admits(head(90), head(91, true))).toEqual([false, true]);
    expect(gate.lost).toBe(0);
  });
});
