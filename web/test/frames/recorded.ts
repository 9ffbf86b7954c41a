/** Bytes of a short recorded flight, as the tower's recorder writes them. */

import { encode } from '../../src/link/mavlink';
import type { MessageFields, MessageName } from '../../src/link/generated/mavlink.gen';

export const BEGAN_MS = 1_764_000_000_000;
const AUTOPILOT = { sysid: 1, compid: 1 };
const PERSON = { sysid: 255, compid: 190 };

export function entry(atMs: number, frame: Uint8Array): Uint8Array {
  const bytes = new Uint8Array(8 + frame.length);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(Math.round(atMs * 1000)));
  bytes.set(frame, 8);
  return bytes;
}

export const said = <N extends MessageName>(name: N, fields: Partial<MessageFields[N]>): Uint8Array =>
  encode(name, fields, AUTOPILOT, 0);
export const sent = <N extends MessageName>(name: N, fields: Partial<MessageFields[N]>): Uint8Array =>
  encode(name, fields, PERSON, 0);

export function whole(pieces: readonly Uint8Array[]): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(pieces.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const piece of pieces) {
    bytes.set(piece, at);
    at += piece.length;
  }
  return bytes;
}

/** Ten messages a second: it climbs a metre a second to the north-east, and changes its mode at half time. */
export function aFlight(seconds: number): Uint8Array<ArrayBuffer> {
  const pieces: Uint8Array[] = [];
  for (let step = 0; step < seconds * 10; step++) {
    const atMs = BEGAN_MS + step * 100;
    if (step % 10 === 0) {
      const custom_mode = step < seconds * 5 ? 4 : 6;
      pieces.push(
        entry(atMs, said('HEARTBEAT', { type: 2, autopilot: 3, base_mode: 0x81, custom_mode, system_status: 4 })),
      );
    }
    const lat = 470_000_000 + step * 10;
    pieces.push(
      entry(atMs, said('GLOBAL_POSITION_INT', { lat, lon: 80_000_000, relative_alt: step * 100, hdg: 4500 })),
      entry(atMs, said('ATTITUDE', { roll: step / 1000, pitch: 0, yaw: 1 })),
    );
    if (step === 1) pieces.push(entry(atMs, said('HOME_POSITION', { latitude: 470_000_000, longitude: 80_000_000 })));
    if (step === 15) pieces.push(entry(atMs, said('STATUSTEXT', { severity: 4, text: 'EKF variance' })));
    if (step >= 20 && step < 30)
      pieces.push(entry(atMs, sent('MANUAL_CONTROL', { target: 1, x: 500, y: -1000, z: 750 })));
  }
  return whole(pieces);
}
