/**
 * A plan's hash, the same as agent and tower compute (wire/plans.py): compares the plan on the drone with the one on
 * the screen by sixteen digits. Synchronous and without Web Crypto, which browsers deny to pages over plain HTTP.
 */

import { sha256 } from '@noble/hashes/sha2.js';
import { bytesToHex } from '@noble/hashes/utils.js';

import type { PlanKind, WireItem } from './plan_types';

const KIND_BYTE: Record<PlanKind, number> = { mission: 0, fence: 1, rally: 2 };
const HEADER_BYTES = 3;
const ITEM_BYTES = 32;
/** The one NaN for "not given"; engines may write others. */
const QUIET_NAN = 0x7fc0_0000;

/**
 * Packs negative zeros as plain ones: JSON, which carries plans, does not always preserve the sign. Little-endian: kind
 * u8, count u16, then for each item command u16, frame u8, p1-p4 f32, x i32, y i32, z f32, autocontinue u8.
 */
export function packedPlan(kind: PlanKind, items: readonly WireItem[]): Uint8Array<ArrayBuffer> {
  if (items.length > 0xffff) throw new RangeError(`A plan of ${items.length} items cannot be packed.`);
  const bytes = new Uint8Array(HEADER_BYTES + ITEM_BYTES * items.length);
  const view = new DataView(bytes.buffer);
  view.setUint8(0, KIND_BYTE[kind]);
  view.setUint16(1, items.length, true);
  for (const [seq, item] of items.entries()) {
    const from = HEADER_BYTES + ITEM_BYTES * seq;
    view.setUint16(from, item.command, true);
    view.setUint8(from + 2, item.frame);
    for (const [index, value] of item.params.entries()) {
      const place = from + 3 + 4 * index;
      if (value === null) view.setUint32(place, QUIET_NAN, true);
      else view.setFloat32(place, value + 0, true);
    }
    view.setInt32(from + 19, item.x, true);
    view.setInt32(from + 23, item.y, true);
    view.setFloat32(from + 27, item.z + 0, true);
    view.setUint8(from + 31, item.autocontinue);
  }
  return bytes;
}

/** 16 hexadecimal digits: the first 8 bytes of SHA-256 over the packed plan. */
export const planHash = (kind: PlanKind, items: readonly WireItem[]): string =>
  bytesToHex(sha256(packedPlan(kind, items)).subarray(0, 8));

export type OnBoard = 'on the drone' | 'changed' | 'unknown';

/** `onBoard` is the hash that the drone's agent reported, null if unknown. */
export const comparedWith = (onBoard: string | null, kind: PlanKind, items: readonly WireItem[]): OnBoard =>
  onBoard === null ? 'unknown' : onBoard === planHash(kind, items) ? 'on the drone' : 'changed';
