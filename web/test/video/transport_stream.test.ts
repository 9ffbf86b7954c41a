import { describe, expect, it } from 'vitest';

import { TransportStream } from '../../src/video/transport_stream';
import { goldenUnits } from './golden_units';

const PES = [0, 0, 1, 0xe0, 0, 0, 0x80, 0x80, 5, 1, 2, 3, 4, 5];

/** One packet, padded with an adaptation field as a multiplexer does. */
function packet(pid: number, payload: readonly number[], { begins = false, flags = 0x10, sync = 0x47 } = {}): number[] {
  const head = [sync, (begins ? 0x40 : 0) | (pid >> 8), pid & 0xff];
  const stuffing = 184 - payload.length;
  if (stuffing === 0) return [...head, flags, ...payload];
  const adaptation = [stuffing - 1, ...(stuffing > 1 ? [0, ...Array<number>(stuffing - 2).fill(0xff)] : [])];
  return [...head, flags | 0x20, ...adaptation, ...payload];
}

const joined = (pieces: readonly Uint8Array[]): number[] => pieces.flatMap((piece) => [...piece]);
const demuxed = (...packets: number[][]): number[] =>
  joined(new TransportStream().pieces(Uint8Array.from(packets.flat())));

describe('the transport stream', () => {
  it('gives the pictures of the agent whole', () => {
    const stream = new TransportStream();
    for (const { unit } of goldenUnits('mpeg1')) {
      const picture = joined(stream.pieces(unit.payload));
      const code = picture.slice(0, 4);
      expect(code).toEqual(unit.isKey ? [0, 0, 1, 0xb3] : [0, 0, 1, 0x00]);
      expect(picture.length).toBeGreaterThan(unit.payload.length * 0.5);
    }
  });

  it('leaves out the header of the picture, and what fills packets up', () => {
    const full = Array.from({ length: 184 }, (_, at) => at);
    expect(demuxed(packet(256, [...PES, 9, 8, 7], { begins: true }), packet(256, full), packet(256, [6]))).toEqual([
      9,
      8,
      7,
      ...full,
      6,
    ]);
  });

  it('leaves out tables, other streams, and what is broken', () => {
    const audio = PES.with(3, 0xc0);
    const before = packet(256, [...PES, 1], { begins: true });
    expect(
      demuxed(
        packet(0, [0, 0, 176, 13], { begins: true }),
        before,
        packet(257, [...audio, 2], { begins: true }),
        packet(257, [3]),
        packet(256, [4], { sync: 0x48 }),
        packet(256, [5], { flags: 0 }),
        [...packet(256, [6])].with(1, 0x81),
        packet(256, [7]),
      ),
    ).toEqual([1, 7]);
  });

  it('has nothing without a beginning, and nothing of half a packet', () => {
    expect(demuxed(packet(256, [1, 2, 3]))).toEqual([]);
    expect(demuxed(packet(256, [...PES, 1], { begins: true }).slice(0, 187))).toEqual([]);
    expect(demuxed()).toEqual([]);
  });

  it('survives any bytes', () => {
    let random = 1;
    const stream = new TransportStream();
    for (let round = 0; round < 500; round++) {
      const bytes = Uint8Array.from({ length: 188 * 3 }, (_, at) => {
        random = (random * 1_103_515_245 + 12_345) % 2 ** 31;
        return at % 188 === 0 ? 0x47 : random >> 8;
      });
      for (const piece of stream.pieces(bytes)) expect(piece.length).toBeLessThanOrEqual(184);
    }
  });
});
