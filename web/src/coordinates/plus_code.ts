/** Reads plus codes (Open Location Code): whole ones, and short ones beside a known place. Pure. */

import type { Place } from '../link/messages';

const DIGITS = '23456789CFGHJMPQRVWX';
const SEPARATOR_AT = 8;
const PAIRS = 10;
const GRID_COLUMNS = 4;
const GRID_ROWS = 5;
const MAX_LENGTH = 15;
const CODE = /^([23456789CFGHJMPQRVWX]{0,8})(0{0,6})\+([23456789CFGHJMPQRVWX]*)$/i;

export function readPlusCode(text: string, near: Place | null): Place | null {
  const found = CODE.exec(text);
  if (!found) return null;
  const [before, padding, after] = [found[1]!.toUpperCase(), found[2]!, found[3]!.toUpperCase()];
  if (before.length + padding.length === SEPARATOR_AT) {
    const isPadded = padding.length > 0;
    if (isPadded && (after !== '' || before.length % 2 === 1 || before.length === 0)) return null;
    return after.length === 1 ? null : centre(before + after);
  }
  const isShort = padding === '' && before.length % 2 === 0 && before.length >= 2 && after.length >= 2;
  return isShort && near ? completed(before + after, SEPARATOR_AT - before.length, near) : null;
}

function centre(code: string): Place | null {
  if (code.length > MAX_LENGTH) return null;
  const digits = [...code].map((digit) => DIGITS.indexOf(digit));
  let [lat, lon, latStep, lonStep] = [-90, -180, 20 * 20, 20 * 20];
  for (let at = 0; at < Math.min(digits.length, PAIRS); at += 2) {
    latStep /= 20;
    lonStep /= 20;
    lat += digits[at]! * latStep;
    lon += digits[at + 1]! * lonStep;
  }
  for (const digit of digits.slice(PAIRS)) {
    latStep /= GRID_ROWS;
    lonStep /= GRID_COLUMNS;
    lat += Math.floor(digit / GRID_COLUMNS) * latStep;
    lon += (digit % GRID_COLUMNS) * lonStep;
  }
  if (lat >= 90 || lon >= 180) return null;
  return { latDeg: Math.min(90, lat + latStep / 2), lonDeg: lon + lonStep / 2 };
}

/** `missing`: how many digits of its beginning are left out. The nearest place to the known one is meant. */
function completed(code: string, missing: number, near: Place): Place | null {
  const prefix = encoded(near).slice(0, missing);
  const found = centre(prefix + code);
  if (!found) return null;
  const stepDeg = 20 ** (2 - missing / 2);
  let { latDeg, lonDeg } = found;
  if (near.latDeg - latDeg > stepDeg / 2 && latDeg + stepDeg <= 90) latDeg += stepDeg;
  else if (latDeg - near.latDeg > stepDeg / 2 && latDeg - stepDeg >= -90) latDeg -= stepDeg;
  if (near.lonDeg - lonDeg > stepDeg / 2) lonDeg += stepDeg;
  else if (lonDeg - near.lonDeg > stepDeg / 2) lonDeg -= stepDeg;
  return { latDeg, lonDeg };
}

/** The first eight digits. */
function encoded({ latDeg, lonDeg }: Place): string {
  let [lat, lon] = [Math.min(latDeg, 89.9999) + 90, lonDeg + 180];
  let code = '';
  for (let at = 0, step = 20; at < 4; at += 1, step /= 20) {
    const [y, x] = [Math.floor(lat / step), Math.floor(lon / step)];
    code += DIGITS[y % 20]! + DIGITS[x % 20]!;
    lat -= y * step;
    lon -= x * step;
  }
  return code;
}
