/**
 * Extracts the video from MPEG-TS: the packets of one unit, which is one whole picture. So only the video's packet id
 * carries over from unit to unit.
 */

const PACKET_BYTES = 188;
const SYNC = 0x47;
const NO_STREAM = -1;

const isVideo = (streamId: number): boolean => streamId >= 0xe0 && streamId <= 0xef;

export class TransportStream {
  #pid = NO_STREAM;

  /** Views of the pieces of the elementary stream, in order. Skips invalid and broken packets. */
  pieces(unit: Uint8Array): Uint8Array[] {
    const found: Uint8Array[] = [];
    for (let at = 0; at + PACKET_BYTES <= unit.length; at += PACKET_BYTES) {
      const piece = this.#piece(unit.subarray(at, at + PACKET_BYTES));
      if (piece && piece.length > 0) found.push(piece);
    }
    return found;
  }

  #piece(packet: Uint8Array): Uint8Array | null {
    const [sync = 0, high = 0, low = 0, control = 0, adaptationBytes = 0] = packet;
    const isBroken = (high & 0x80) !== 0;
    const hasPayload = (control & 0x10) !== 0;
    if (sync !== SYNC || isBroken || !hasPayload) return null;
    const pid = ((high & 0x1f) << 8) | low;
    const from = (control & 0x20) !== 0 ? 5 + adaptationBytes : 4;
    const payload = packet.subarray(from);
    const isBeginning = (high & 0x40) !== 0;
    if (!isBeginning) return pid === this.#pid ? payload : null;
    return this.#afterHeader(pid, payload);
  }

  /** For a packet that begins something: a PES packet of the video, or a table that is irrelevant here. */
  #afterHeader(pid: number, payload: Uint8Array): Uint8Array | null {
    const isPes = payload.length >= 9 && payload[0] === 0 && payload[1] === 0 && payload[2] === 1;
    if (!isPes || !isVideo(payload[3] ?? 0)) return null;
    this.#pid = pid;
    return payload.subarray(9 + (payload[8] ?? 0));
  }
}
