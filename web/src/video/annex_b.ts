/** What a decoder must know about an H.264 stream in Annex B before it begins: read from its parameter sets. */

const SPS = 7;

/** `avc1.PPCCLL`: profile, constraints and level of the first sequence parameter set; null without one. */
export function codecString(accessUnit: Uint8Array): string | null {
  for (let at = 0; at + 6 < accessUnit.length; at++) {
    if (accessUnit[at] !== 0 || accessUnit[at + 1] !== 0 || accessUnit[at + 2] !== 1) continue;
    const kind = (accessUnit[at + 3] ?? 0) & 0x1f;
    if (kind === SPS) return `avc1.${hex(accessUnit.subarray(at + 4, at + 7))}`;
    if (kind >= 1 && kind <= 5) return null; // the picture itself: parameter sets come before it
    at += 2;
  }
  return null;
}

const hex = (bytes: Uint8Array): string =>
  [...bytes]
    .map((byte) => byte.toString(16).padStart(2, '0'))
    .join('')
    .toUpperCase();
