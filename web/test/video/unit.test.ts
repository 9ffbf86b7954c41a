import { describe, expect, it } from 'vitest';

import { HEADER_BYTES, readUnit } from '../../src/video/unit';
import { goldenUnits } from './golden_units';

const first = (): ArrayBuffer => goldenUnits('mpeg1')[0]!.message.slice(0);

function spoilt(at: number, value: number): ArrayBuffer {
  const message = first();
  new DataView(message).setUint8(at, value);
  return message;
}

describe('a unit', () => {
  it('is read as the agent wrote it', () => {
    const unit = readUnit(first())!;
    expect(unit).toMatchObject({
      quality: 'medium',
      codec: 'mpeg1',
      sequence: 2 ** 32 - 3,
      isKey: true,
      isBreak: false,
      captureUs: 1_000_000,
      width: 120,
      height: 68,
    });
    expect(unit.payload.length).toBe(first().byteLength - HEADER_BYTES);
    expect(unit.payload[0]).toBe(0x47);
    expect(goldenUnits('mpeg1').map((one) => one.unit.isKey)).toEqual([true, ...Array(5).fill(false), true, false]);
    expect(goldenUnits('h264')[1]!.unit).toMatchObject({ codec: 'h264', sequence: 1, isKey: false });
  });

  it('has no time where the tower does not know it, and any that a machine can count to', () => {
    const message = first();
    const view = new DataView(message);
    view.setBigUint64(8, 0n, true);
    expect(readUnit(message)!.captureUs).toBeNull();
    view.setBigUint64(8, 9_007_199_254_740_991n, true);
    expect(readUnit(message)!.captureUs).toBe(Number.MAX_SAFE_INTEGER);
  });

  it.each([
    ['another version', spoilt(0, 2)],
    ['an unknown flag', spoilt(1, 4)],
    ['an unknown quality', spoilt(2, 3)],
    ['no codec', spoilt(3, 0)],
    ['an unknown codec', spoilt(3, 3)],
    ['a header alone', first().slice(0, HEADER_BYTES)],
    ['nothing', new ArrayBuffer(0)],
  ])('%s is none', (_, message) => {
    expect(readUnit(message)).toBeNull();
  });
});
