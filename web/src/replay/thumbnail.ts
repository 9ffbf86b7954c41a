/** The way of a flight as the path of a small picture. Pure. */

const MIN_SPAN_M = 30;
const METRES_PER_DEGREE = 111_319.49;

export interface Thumbnail {
  /** For `d` of an SVG path. */
  readonly path: string;
  readonly begin: readonly [number, number];
  readonly end: readonly [number, number];
}

/** North is up, and as wide as high over ground; null without a way. `track`: latitudes and longitudes. */
export function thumbnail(
  track: readonly (readonly number[])[],
  widthPx: number,
  heightPx: number,
  marginPx = 4,
): Thumbnail | null {
  const first = track[0];
  if (!first || track.length < 2) return null;
  const wide = Math.cos((first[0]! * Math.PI) / 180);
  const places = track.map(([lat, lon]): [number, number] => [
    (((((lon! - first[1]! + 540) % 360) + 360) % 360) - 180) * wide * METRES_PER_DEGREE,
    (first[0]! - lat!) * METRES_PER_DEGREE,
  ]);
  const xs = places.map(([x]) => x);
  const ys = places.map(([, y]) => y);
  const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const scale = Math.min(
    (widthPx - 2 * marginPx) / Math.max(MIN_SPAN_M, right - left),
    (heightPx - 2 * marginPx) / Math.max(MIN_SPAN_M, bottom - top),
  );
  const on = ([x, y]: [number, number]): [number, number] => [
    round(widthPx / 2 + (x - (left + right) / 2) * scale),
    round(heightPx / 2 + (y - (top + bottom) / 2) * scale),
  ];
  const drawn = places.map(on);
  return { path: `M${drawn.map((one) => one.join(' ')).join('L')}`, begin: drawn[0]!, end: drawn.at(-1)! };
}

const round = (px: number): number => Math.round(px * 10) / 10;
