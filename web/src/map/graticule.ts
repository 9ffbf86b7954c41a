/** The grid of latitude and longitude: gives position and scale where the basemap is empty. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { fontOf, haloText } from './drone_marker';
import type { Projection } from './projection';
import type { MapTheme } from './theme';

const WANTED_SPACING_PX = 150;
const STEPS = [45, 30, 15, 10, 5, 2, 1];
const MAX_LINES = 60;
/** Area of the map's buttons and its read-out: no labels there. */
const BUTTONS_PX = 180;
const READOUT_PX = 36;
const TOP_LABELS_PX = 34;

export interface GridStep {
  readonly stepDeg: number;
  readonly decimals: number;
}

/** A round step near the wanted one: whole degrees, then 0.5, 0.2, 0.1, 0.05, ... */
export function gridStep(wantedDeg: number): GridStep {
  const whole = STEPS.find((step) => step <= wantedDeg);
  if (whole) return { stepDeg: whole, decimals: 0 };
  const decimals = Math.min(7, Math.ceil(-Math.log10(wantedDeg)));
  const unit = 10 ** -decimals;
  const times = wantedDeg >= 5 * unit ? 5 : wantedDeg >= 2 * unit ? 2 : 1;
  return { stepDeg: times * unit, decimals };
}

/** Multiples of the step from `low` to `high`, without the error of repeated addition. */
export function gridLines(low: number, high: number, { stepDeg }: GridStep): number[] {
  const first = Math.ceil(low / stepDeg);
  const last = Math.min(Math.floor(high / stepDeg), first + MAX_LINES);
  return Array.from({ length: Math.max(0, last - first + 1) }, (_, index) => (first + index) * stepDeg);
}

const hemisphere = (value: number, plus: string, minus: string, decimals: number): string =>
  `${Math.abs(value).toFixed(decimals)}°${Math.abs(value) < 1e-9 ? '' : value > 0 ? plus : minus}`;

export function drawGraticule(
  pen: CanvasRenderingContext2D,
  map: MapLibreMap,
  theme: MapTheme,
  projection: Projection,
): void {
  const { clientWidth: width, clientHeight: height } = map.getContainer();
  const bounds = map.getBounds();
  const [west, east, south, north] = [bounds.getWest(), bounds.getEast(), bounds.getSouth(), bounds.getNorth()];
  /** Where it crosses the upper and the lower edge. Meridians of a tilted map converge. */
  const meridian = (lon: number): { x: number; lowX: number } => {
    const low = map.project([lon, south]);
    if (!projection.isTilted) return { x: low.x, lowX: low.x };
    const high = map.project([lon, north]);
    const xAt = (y: number): number => low.x + ((high.x - low.x) * (y - low.y)) / (high.y - low.y);
    return { x: xAt(0), lowX: xAt(height) };
  };
  const step = gridStep(((east - west) / Math.max(1, width)) * WANTED_SPACING_PX);
  const font = `500 10px ${fontOf(pen)}`;

  const meridians = gridLines(west, east, step).map((lon) => ({ lon, ...meridian(lon) }));
  const parallels = gridLines(Math.max(-85, south), Math.min(85, north), step).map((lat) => ({
    lat,
    y: map.project([west, lat]).y,
  }));

  pen.beginPath();
  for (const { x, lowX } of meridians) {
    pen.moveTo(Math.round(x) + 0.5, 0);
    pen.lineTo(Math.round(lowX) + 0.5, height);
  }
  for (const { y } of parallels) {
    pen.moveTo(0, Math.round(y) + 0.5);
    pen.lineTo(width, Math.round(y) + 0.5);
  }
  pen.strokeStyle = theme.grid;
  pen.lineWidth = 1;
  pen.stroke();

  pen.textAlign = 'left';
  pen.textBaseline = 'top';
  for (const { lon, x } of meridians) {
    const around = ((((lon + 180) % 360) + 360) % 360) - 180;
    if (x > width - BUTTONS_PX) continue;
    haloText(pen, theme, hemisphere(around, 'E', 'W', step.decimals), x + 4, 6, font, theme.gridText);
  }
  pen.textBaseline = 'bottom';
  for (const { lat, y } of parallels) {
    if (y < TOP_LABELS_PX || y > height - READOUT_PX) continue;
    haloText(pen, theme, hemisphere(lat, 'N', 'S', step.decimals), 6, y - 3, font, theme.gridText);
  }
}
