/** The unit of live video from the tower: one encoded picture with a fixed header (wire/video.py). */

import type { CodecName, QualityName } from './video_types';

export const HEADER_BYTES = 28;
const VERSION = 1;
const KEY = 1;
const BREAK = 2;

export const QUALITIES: readonly QualityName[] = ['low', 'medium', 'high'];
const CODECS: readonly (CodecName | undefined)[] = [undefined, 'mpeg1', 'h264'];

export interface Unit {
  readonly quality: QualityName;
  readonly codec: CodecName;
  /** Counts the units of one stream; wraps at 2**32. */
  readonly sequence: number;
  /** Decoding can begin here. */
  readonly isKey: boolean;
  /** It does not continue the previous unit. */
  readonly isBreak: boolean;
  /** Time of capture, by the tower's clock, in microseconds; null if unknown. */
  readonly captureUs: number | null;
  readonly width: number;
  readonly height: number;
  /** Current pictures per second. */
  readonly rateHz: number;
  /** A view of the message, not a copy. */
  readonly payload: Uint8Array;
}

/** Null for an unknown unit. */
export function readUnit(message: ArrayBuffer): Unit | null {
  if (message.byteLength <= HEADER_BYTES) return null;
  const view = new DataView(message);
  const flags = view.getUint8(1);
  const quality = QUALITIES[view.getUint8(2)];
  const codec = CODECS[view.getUint8(3)];
  const width = view.getUint16(16, true);
  const height = view.getUint16(18, true);
  const rateHz = view.getUint16(20, true) / 100;
  const isOurs = view.getUint8(0) === VERSION && !(flags & ~(KEY | BREAK));
  if (!isOurs || !quality || !codec || !width || !height || !rateHz) return null;
  // Microseconds since the boot of the tower's machine: exact in a double for 285 years.
  const captureUs = view.getUint32(8, true) + view.getUint32(12, true) * 2 ** 32;
  return {
    quality,
    codec,
    sequence: view.getUint32(4, true),
    isKey: (flags & KEY) !== 0,
    isBreak: (flags & BREAK) !== 0,
    captureUs: captureUs || null,
    width,
    height,
    rateHz,
    payload: new Uint8Array(message, HEADER_BYTES),
  };
}
