/**
 * Reads a place as people write it: decimal degrees (with points or commas), degrees with minutes and seconds, UTM,
 * MGRS, a plus code, a geo: URI or the address of a map. Every field of the console for a place reads with it. Pure.
 */

import { t } from '../languages/text';
import type { Place } from '../link/messages';
import { isGeoUri, isPlaceAddress, readPlaceAddress } from './map_link';
import { readMgrs } from './mgrs';
import { readPlusCode } from './plus_code';
import { readUtm } from './utm';

export type PlaceRead =
  { readonly place: Place; readonly fault: '' } | { readonly place: null; readonly fault: string };

/** Longer texts are no place; a table of hostile ones must not take minutes. */
const MAX_LENGTH = 100;
const MAX_ADDRESS_LENGTH = 1000;
const MAX_QUOTED = 60;

const failed = (fault: string): PlaceRead => ({ place: null, fault });

/** `near`: completes a short plus code. The fault says what was not understood, and what would be. */
export function readPlace(text: string, near: Place | null = null): PlaceRead {
  const trimmed = text.trim().replace(/\s+/g, ' ');
  if (trimmed === '') return failed(t('A place is needed.'));
  const isAddress = isPlaceAddress(trimmed);
  if (trimmed.length > (isAddress ? MAX_ADDRESS_LENGTH : MAX_LENGTH))
    return failed(t('This text is too long to be a place.'));
  if (isAddress) {
    const { place, isShort } = readPlaceAddress(trimmed);
    if (place) return onEarth(place);
    if (isShort)
      return failed(t('A short address does not hold the place: open it, and copy the address it leads to.'));
    return failed(
      isGeoUri(trimmed)
        ? t('This geo: address has no place in degrees (WGS 84).')
        : t('This address holds no latitude and longitude.'),
    );
  }
  const plain = plainOf(trimmed);
  const grid = readUtm(plain) ?? readUtm(withPoints(plain)) ?? readMgrs(plain);
  const found = grid ?? readDecimal(plain) ?? readSexagesimal(plain) ?? readPlusCode(plain, near);
  return found ? onEarth(found) : failed(faultOf(trimmed, plain));
}

/** Null: no coordinate. */
export const readCoordinate = (text: string, near: Place | null = null): Place | null => readPlace(text, near).place;

/** Whether a text that is no place was meant as one. */
export const isMeantAsPlace = (text: string): boolean =>
  isPlaceAddress(text.trim()) || /\d[^a-z]*[,;°'"\s][^a-z]*\d/i.test(text.slice(0, MAX_LENGTH));

function onEarth(place: Place): PlaceRead {
  const { latDeg, lonDeg } = place;
  if (Math.abs(latDeg) > 90) {
    const isSwapped = Math.abs(lonDeg) <= 90 && Math.abs(latDeg) <= 180;
    const words = t('Latitude {latDeg} is beyond 90 degrees.', { latDeg });
    return failed(isSwapped ? `${words} ${t('Is the longitude first?')}` : words);
  }
  if (Math.abs(lonDeg) > 180) return failed(t('Longitude {lonDeg} is beyond 180 degrees.', { lonDeg }));
  return { place, fault: '' };
}

/** What was not understood. */
function faultOf(text: string, plain: string): string {
  const quoted = text.length > MAX_QUOTED ? `${text.slice(0, MAX_QUOTED)}…` : text;
  if (/^[+-]?\d+([.,]\d+)?°?$/.test(plain)) {
    return t('One number is no place: latitude and longitude are needed, as 47.3977, 8.5456.');
  }
  if (/\d[°'" ]*O\b|\bO ?\d/i.test(plain)) {
    return t('"O" is east in German and west in Portuguese and French: write E or W.');
  }
  const tooMany = /\d[°d: ] ?([6-9]\d|\d{3,})(\.\d+)?['m:]|['m:] ?([6-9]\d|\d{3,})(\.\d+)?["s]/i.exec(plain);
  if (tooMany) return t('"{text}": minutes and seconds are below 60.', { text: quoted });
  if (/^\d{1,2} ?[A-Z] ?[A-Z]{2}(?![A-Z])/i.test(plain))
    return t('"{text}": MGRS has no such square.', { text: quoted });
  if (/^[ABYZ] ?[A-Z]{2} ?\d/i.test(plain)) return t('Places in the polar grid (UPS) are not read.');
  if (/^[0-9A-Z]{2,8}\+/i.test(plain)) {
    return t('"{text}" is no whole plus code, and no place is near to complete it.', { text: quoted });
  }
  return t('"{text}" is not understood as a place. Write 47.3977, 8.5456, or degrees with N, S, E, W, UTM or MGRS.', {
    text: quoted,
  });
}

const LABELS = /(?<![a-z])(?:latitude|longitude|lat|long|lng|lon)\b\.?["']?\s*[:=]?\s*/gi;
const LONGITUDE_FIRST = /^[^a-z]*lo?n/i;

/** One kind of sign for each meaning, no brackets, no "lat:" and "lon:". */
function plainOf(text: string): string {
  const signs = text
    .replace(/[’‘´`′ʹ]/g, "'")
    .replace(/[“”″ʺ]/g, '"')
    .replace(/''/g, '"')
    .replace(/[º˚]/g, '°')
    .replace(/[−–]/g, '-')
    .replace(/^[([{]|[)\]}]$/g, '')
    .trim();
  if (!/(?<![a-z])l(at|o?n)/i.test(signs)) return signs;
  const isSwapped = LONGITUDE_FIRST.test(signs);
  const bare = signs
    .replace(/["'](?=l(at|o?n))/gi, '')
    .replace(LABELS, ' ')
    .replace(/\s+/g, ' ')
    .trim();
  if (!isSwapped) return bare;
  const parts = /^(\S+?)[,; ]\s*(\S+)$/.exec(bare);
  return parts ? `${parts[2]} ${parts[1]}` : bare;
}

/** With decimal commas as points. */
const withPoints = (text: string): string => (text.includes('.') ? text : text.replace(/(\d),(?=\d)/g, '$1.'));

const DEGREES = String.raw`([+-]?\d{1,3}(?:\.\d+)?)°?`;
const POINTS = new RegExp(String.raw`^${DEGREES}\s*[,; ]\s*${DEGREES}$`);
const COMMA_DEGREES = String.raw`([+-]?\d{1,3}(?:,\d+)?)°?`;
/** A comma with a blank behind it, a semicolon or a blank is between the two numbers. */
const COMMAS = new RegExp(String.raw`^${COMMA_DEGREES}(?: ?; ?| ?, | )${COMMA_DEGREES}$`);
const FOUR_PARTS = /^([+-]?\d{1,3},\d+),([+-]?\d{1,3},\d+)$/;

/** "47.3977, 8.5456", "47,3977 8,5456"; a space or a semicolon does as well. Latitude first. */
function readDecimal(text: string): Place | null {
  const points = POINTS.exec(text);
  if (points) return { latDeg: Number(points[1]), lonDeg: Number(points[2]) };
  const commas = COMMAS.exec(text) ?? FOUR_PARTS.exec(text);
  const number = (part: string): number => Number(part.replace(',', '.'));
  return commas ? { latDeg: number(commas[1]!), lonDeg: number(commas[2]!) } : null;
}

const PART = String.raw`(\d{1,3}(?:\.\d+)?)(?:[°d: ]\s*(?:(\d{1,2}(?:\.\d+)?)(?:['m:]| |(?=[NSEWL,;]|$))\s*(?:(\d{1,2}(?:\.\d+)?)["s]?)?)?)?`;
const BETWEEN = String.raw`\s*[,; ]*\s*`;
const LETTER_LAST = new RegExp(String.raw`^${PART}\s*([NSEWL])${BETWEEN}${PART}\s*([NSEWL])$`, 'i');
const LETTER_FIRST = new RegExp(String.raw`^([NSEWL])\s*${PART}${BETWEEN}([NSEWL])\s*${PART}$`, 'i');
const SIGNED_PART = String.raw`([+-]?)(\d{1,3})°\s*(\d{1,2}(?:\.\d+)?)'\s*(?:(\d{1,2}(?:\.\d+)?)")?`;
const SIGNED = new RegExp(String.raw`^${SIGNED_PART}${BETWEEN}${SIGNED_PART}$`);

/** 47°23'51.7"N 8°32'44.2"E, N47 23.862 E8 32.737, 47.3977N 8.5456E; east first if its letter says so. */
function readSexagesimal(text: string): Place | null {
  for (const one of [text, withPoints(text)]) {
    const [last, first, signed] = [LETTER_LAST.exec(one), LETTER_FIRST.exec(one), SIGNED.exec(one)];
    if (last)
      return paired(degrees(last.slice(1, 4), last[4]!), last[4]!, degrees(last.slice(5, 8), last[8]!), last[8]!);
    if (first)
      return paired(degrees(first.slice(2, 5), first[1]!), first[1]!, degrees(first.slice(6, 9), first[5]!), first[5]!);
    if (signed) {
      const letters = [signed[1] === '-' ? 'S' : 'N', signed[5] === '-' ? 'W' : 'E'] as const;
      return paired(
        degrees(signed.slice(2, 5), letters[0]),
        letters[0],
        degrees(signed.slice(6, 9), letters[1]),
        letters[1],
      );
    }
  }
  return null;
}

/** Null unless one is a latitude and the other a longitude. */
function paired(one: number | null, oneLetter: string, other: number | null, otherLetter: string): Place | null {
  const [isLat, isOtherLat] = [oneLetter, otherLetter].map((letter) => /[NS]/i.test(letter));
  if (one === null || other === null || isLat === isOtherLat) return null;
  return isLat ? { latDeg: one, lonDeg: other } : { latDeg: other, lonDeg: one };
}

/** L is east: leste in Portuguese. */
function degrees(parts: readonly (string | undefined)[], letter: string): number | null {
  const [whole, minutes, seconds] = parts.map((part) => Number(part ?? 0)) as [number, number, number];
  if (minutes >= 60 || seconds >= 60) return null;
  const value = whole + minutes / 60 + seconds / 3600;
  return /[SW]/i.test(letter) ? -value : value;
}
