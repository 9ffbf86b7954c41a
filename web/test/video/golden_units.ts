/** Units as the agent encodes them, with the output of FFmpeg's decoders (scripts/generate_video_units.py). */

import golden from '../golden/video_units.json';
import { readUnit, type Unit } from '../../src/video/unit';

export interface GoldenUnit {
  readonly unit: Unit;
  readonly message: ArrayBuffer;
  /** Luma, Cb, Cr of the visible part; empty if nothing is compared. */
  readonly planes: Uint8Array;
}

const bytes = (base64: string): Uint8Array<ArrayBuffer> => Uint8Array.from(Buffer.from(base64, 'base64'));

export function goldenUnits(stream: keyof typeof golden): GoldenUnit[] {
  return golden[stream].map((one) => {
    const message = bytes(one.unit).buffer;
    const unit = readUnit(message);
    if (!unit) throw new Error('the golden unit is none');
    return { unit, message, planes: bytes(one.planes) };
  });
}
