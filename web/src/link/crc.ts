/** CRC-16/MCRF4XX ("X.25" in MAVLink's terms), the checksum of every MAVLink frame. */

const TABLE = new Uint16Array(256);
for (let byte = 0; byte < 256; byte++) {
  let crc = byte;
  for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0x8408 : crc >>> 1;
  TABLE[byte] = crc;
}

export const CRC_START = 0xffff;

export function crcAdd(crc: number, byte: number): number {
  return (crc >>> 8) ^ TABLE[(crc ^ byte) & 0xff]!;
}

export function crcOf(bytes: Uint8Array, from: number, to: number, start = CRC_START): number {
  let crc = start;
  for (let index = from; index < to; index++) crc = crcAdd(crc, bytes[index]!);
  return crc;
}
