/** Reads a place from text: decimal degrees, degrees with minutes and seconds, UTM, or a plus code. Pure. */

import type { Place } from '../link/messages';
import { readPlusCode } from './plus_code';
import { readUtm } from './utm';

const isOnEarth = ({ latDeg, lonDeg }: Place): boolean => Math.abs(latDeg) <= 90 && Math.abs(lonDeg) <= 180;

/** `near`: completes a short plus code. Null: no coordinate. */
export function readCoordinate(text: string, near: Place | null = null): Place | null {
  const trimmed = text.trim().replace(/\s+/g, ' ');
  if (trimmed === '') return null;
  const found = readDecimal(trimmed) ?? readSexagesimal(trimmed) ?? readUtm(trimmed) ?? readPlusCode(trimmed, near);
  return found && isOnEarth(found) ? found : null;
}

/** "47.3977, 8.5456"; a space or a semicolon does as well. Latitude first. */
function readDecimal(text: string): Place | null {
  const parts = /^([+-]?\d{1,3}(?:\.\d+)?)°?\s*[,; ]\s*([+-]?\d{1,3}(?:\.\d+)?)°?$/.exec(text);
  return parts ? { latDeg: Number(parts[1]), lonDeg: Number(parts[2]) } : null;
}

const PART = String.raw`(\d{1,3}(?:\.\d+)?)[°d: ]\s*(?:(\d{1,2}(?:\.\d+)?)['′m: ]?\s*)?(?:(\d{1,2}(?:\.\d+)?)(?:["″s]|'')?\s*)?`;
const LETTER_LAST = new RegExp(`^${PART}([NS])[,; ]*${PART}([EW])$`, 'i');
const LETTER_FIRST = new RegExp(`^([NS])\\s*${PART}[,; ]*([EW])\\s*${PART}$`, 'i');
const DECIMAL_LETTERS = /^(\d{1,2}(?:\.\d+)?)°? ?([NS])[,; ]*(\d{1,3}(?:\.\d+)?)°? ?([EW])$/i;

/** 47°23'51.7"N 8°32'44.2"E, N47 23.862 E8 32.737, 47.3977N 8.5456E. */
function readSexagesimal(text: string): Place | null {
  const plain = DECIMAL_LETTERS.exec(text);
  if (plain) {
    return made(signed(Number(plain[1]), plain[2]!, 'S'), signed(Number(plain[3]), plain[4]!, 'W'));
  }
  const last = LETTER_LAST.exec(`${text}`);
  if (last) return made(degrees(last.slice(1, 4), last[4]!, 'S'), degrees(last.slice(5, 8), last[8]!, 'W'));
  const first = LETTER_FIRST.exec(`${text} `.trimEnd());
  if (first) return made(degrees(first.slice(2, 5), first[1]!, 'S'), degrees(first.slice(6, 9), first[5]!, 'W'));
  return null;
}

const made = (latDeg: number | null, lonDeg: number | null): Place | null =>
  latDeg === null || lonDeg === null ? null : { latDeg, lonDeg };

const signed = (value: number, letter: string, negative: string): number =>
  letter.toUpperCase() === negative ? -value : value;

function degrees(parts: readonly (string | undefined)[], letter: string, negative: string): number | null {
  const [whole, minutes, seconds] = parts.map((part) => Number(part ?? 0)) as [number, number, number];
  if (minutes >= 60 || seconds >= 60) return null;
  return signed(whole + minutes / 60 + seconds / 3600, letter, negative);
}
