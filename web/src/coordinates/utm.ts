/** Reads UTM (WGS 84): "32T 465886 5249507", "32N 465886mE 5249507mN". By Krüger's series, to a millimetre. Pure. */

import type { Place } from '../link/messages';

const A_M = 6_378_137;
const F = 1 / 298.257223563;
const SCALE = 0.9996;
const FALSE_EAST_M = 500_000;
const FALSE_NORTH_M = 10_000_000;
const N = F / (2 - F);
const RECTIFYING_M = (A_M / (1 + N)) * (1 + N ** 2 / 4 + N ** 4 / 64);
const BETA = [N / 2 - (2 / 3) * N ** 2 + (37 / 96) * N ** 3, N ** 2 / 48 + N ** 3 / 15, (17 / 480) * N ** 3] as const;
const DELTA = [2 * N - (2 / 3) * N ** 2 - 2 * N ** 3, (7 / 3) * N ** 2 - (8 / 5) * N ** 3, (56 / 15) * N ** 3] as const;
const BANDS = 'CDEFGHJKLMNPQRSTUVWX';
const UTM = /^(\d{1,2}) ?([A-HJ-NP-Z])[ ,]+(\d{5,7}(?:\.\d+)?) ?(?:m ?E|E)?[ ,]+(\d{1,8}(?:\.\d+)?) ?(?:m ?N|N)?$/i;

/** The letter is a latitude band; N and S alone are taken as the hemispheres, which most programs mean by them. */
export function readUtm(text: string): Place | null {
  const found = UTM.exec(text);
  if (!found) return null;
  const [zone, letter] = [Number(found[1]), found[2]!.toUpperCase()];
  const isSouth = letter === 'S' || (letter !== 'N' && letter < 'N');
  if (zone < 1 || zone > 60 || !BANDS.includes(letter)) return null;
  return utmToPlace(zone, isSouth, Number(found[3]), Number(found[4]));
}

export function utmToPlace(zone: number, isSouth: boolean, eastM: number, northM: number): Place {
  const xi = (northM - (isSouth ? FALSE_NORTH_M : 0)) / (SCALE * RECTIFYING_M);
  const eta = (eastM - FALSE_EAST_M) / (SCALE * RECTIFYING_M);
  let [xi1, eta1] = [xi, eta];
  for (const [at, beta] of BETA.entries()) {
    const twice = 2 * (at + 1);
    xi1 -= beta * Math.sin(twice * xi) * Math.cosh(twice * eta);
    eta1 -= beta * Math.cos(twice * xi) * Math.sinh(twice * eta);
  }
  const chi = Math.asin(Math.sin(xi1) / Math.cosh(eta1));
  const lat = DELTA.reduce((sum, delta, at) => sum + delta * Math.sin(2 * (at + 1) * chi), chi);
  const lon = Math.atan2(Math.sinh(eta1), Math.cos(xi1));
  const lonDeg = (lon * 180) / Math.PI + zone * 6 - 183;
  // The first and the last zone reach over the 180th meridian.
  return { latDeg: (lat * 180) / Math.PI, lonDeg: Math.abs(lonDeg) > 180 ? lonDeg - Math.sign(lonDeg) * 360 : lonDeg };
}
