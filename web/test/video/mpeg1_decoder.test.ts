import JSMpeg from '@cycjimmy/jsmpeg-player';
import { describe, expect, it } from 'vitest';

import { Mpeg1Decoder } from '../../src/video/mpeg1_decoder';
import { colours } from '../../src/video/plain_screen';
import type { Planes } from '../../src/video/screen';
import { TransportStream } from '../../src/video/transport_stream';
import { goldenUnits, type GoldenUnit } from './golden_units';

const module = new WebAssembly.Module(Buffer.from(JSMpeg.WASM_BINARY_INLINED, 'base64'));
const open = (): Mpeg1Decoder => new Mpeg1Decoder(module);

/** The visible part of the planes, one after another, as FFmpeg outputs them. */
function shown({ width, height, codedWidth, y, cb, cr }: Planes): Uint8Array {
  const rows = (plane: Uint8Array, wide: number, line: number, high: number): number[] =>
    Array.from({ length: high }, (_, row) => [...plane.subarray(row * line, row * line + wide)]).flat();
  const half = [width / 2, codedWidth / 2, height / 2] as const;
  return Uint8Array.from([...rows(y, width, codedWidth, height), ...rows(cb, ...half), ...rows(cr, ...half)]);
}

function offBy(ours: Uint8Array, theirs: Uint8Array): { mean: number; most: number } {
  expect(ours.length).toBe(theirs.length);
  const off = [...ours].map((value, at) => Math.abs(value - theirs[at]!));
  return { mean: off.reduce((sum, one) => sum + one, 0) / off.length, most: Math.max(...off) };
}

function decodeAll(decoder: Mpeg1Decoder, units: readonly GoldenUnit[]): void {
  const packets = new TransportStream();
  for (const { unit, planes } of units) {
    const picture = decoder.decode(packets.pieces(unit.payload));
    expect(picture).not.toBeNull();
    expect([picture!.width, picture!.height]).toEqual([unit.width, unit.height]);
    if (planes.length === 0) continue;
    const { mean, most } = offBy(shown(picture!), planes);
    expect(mean).toBeLessThan(0.5);
    expect(most).toBeLessThan(12);
  }
}

describe('the MPEG-1 decoder', () => {
  it('makes of each unit at once what FFmpeg makes of it', () => {
    decodeAll(open(), goldenUnits('mpeg1'));
  });

  it('takes a stream of another size, and the first one again', () => {
    const decoder = open();
    decodeAll(decoder, goldenUnits('mpeg1'));
    decodeAll(decoder, goldenUnits('mpeg1_smaller'));
    decodeAll(decoder, goldenUnits('mpeg1'));
  });

  it('runs on for many more bytes than it holds', () => {
    const decoder = open();
    const units = goldenUnits('mpeg1');
    const bytes = units.reduce((sum, { unit }) => sum + unit.payload.length, 0);
    for (let sent = 0; sent < 3_000_000; sent += bytes) decodeAll(decoder, units.slice(0, 1));
    decodeAll(decoder, units);
  });

  it('shows nothing of a picture without a beginning', () => {
    const [, second] = goldenUnits('mpeg1');
    expect(open().decode(new TransportStream().pieces(second!.unit.payload))).toBeNull();
    expect(open().decode([])).toBeNull();
  });

  it('survives nonsense, and goes on with the next key picture', () => {
    const decoder = open();
    const units = goldenUnits('mpeg1');
    const pieces = (at: number): Uint8Array[] => new TransportStream().pieces(units[at]!.unit.payload);
    let random = 7;
    for (let round = 0; round < 200; round++) {
      for (const piece of pieces(round % 2)) {
        for (let spoilt = 0; spoilt < 12; spoilt++) {
          random = (random * 1_103_515_245 + 12_345) % 2 ** 31;
          piece[16 + (random % Math.max(1, piece.length - 16))] = random >> 8;
        }
        decoder.decode([piece]);
      }
    }
    decodeAll(decoder, goldenUnits('mpeg1_smaller'));
  });
});

describe('colours without WebGL', () => {
  const flat = (y: number, cb: number, cr: number): Planes => ({
    width: 2,
    height: 2,
    codedWidth: 16,
    codedHeight: 16,
    y: new Uint8Array(256).fill(y),
    cb: new Uint8Array(64).fill(cb),
    cr: new Uint8Array(64).fill(cr),
  });

  it.each([
    ['black', [16, 128, 128], [0, 0, 0]],
    ['white', [235, 128, 128], [255, 255, 255]],
    ['red', [81, 90, 240], [255, 0, 0]],
    ['blue', [41, 240, 110], [0, 0, 255]],
  ] as const)('%s', (_, [y, cb, cr], rgb) => {
    const into = new Uint8ClampedArray(16);
    colours(flat(y, cb, cr), into);
    for (const [at, value] of rgb.entries()) expect(Math.abs(into[12 + at]! - value)).toBeLessThanOrEqual(2);
    expect(into[15]).toBe(255);
  });
});
