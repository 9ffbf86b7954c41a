/** Other aircraft on every map: an arrow along the course, with name, height and age. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { t } from '../languages/text';
import type { Readable } from '../link/store';
import type { Aircraft } from '../link/wire_types';
import { fontOf, haloText } from './drone_marker';
import { MapCanvas, type Sheet } from './map_canvas';
import { onThemeChange, readTheme, type MapTheme } from './theme';

const OLD_S = 5;
const RADIANS = Math.PI / 180;
const ARROW: readonly (readonly [number, number])[] = [
  [0, -11],
  [3, -3],
  [11, 2],
  [3, 3],
  [0, 10],
  [-3, 3],
  [-11, 2],
  [-3, -3],
];

/** `ownAltM`: above the sea, of the drone that the height is compared with; null: none. */
export function aircraftWords(one: Aircraft, ownAltM: number | null): string {
  const climb = one.climb_m_s > 1 ? ' ↑' : one.climb_m_s < -1 ? ' ↓' : '';
  const above = one.alt_amsl_m === null || ownAltM === null ? null : Math.round(one.alt_amsl_m - ownAltM);
  const height =
    one.alt_amsl_m === null
      ? t('height ?')
      : above === null
        ? `${Math.round(one.alt_amsl_m)} m AMSL`
        : `${above < 0 ? '−' : '+'}${Math.abs(above)} m`;
  const age = one.age_s >= OLD_S ? t(', {age} s ago', { age: Math.round(one.age_s) }) : '';
  return `${height}${climb}${age}`;
}

class AircraftOverlay {
  readonly #canvas: MapCanvas;
  readonly #ownAltM: () => number | null;
  #theme: MapTheme = readTheme();
  #aircraft: readonly Aircraft[] = [];

  constructor(map: MapLibreMap, ownAltM: () => number | null) {
    this.#ownAltM = ownAltM;
    this.#canvas = new MapCanvas(map, { testId: 'aircraft-canvas', paint: (sheet) => this.#draw(sheet) });
  }

  set aircraft(aircraft: readonly Aircraft[]) {
    if (aircraft.length === 0 && this.#aircraft.length === 0) return;
    this.#aircraft = aircraft;
    this.#canvas.soon();
  }

  renewTheme(): void {
    this.#theme = readTheme();
    this.#canvas.soon();
  }

  remove(): void {
    this.#canvas.remove();
  }

  #draw({ pen, projection, widthPx, heightPx }: Sheet): void {
    const theme = this.#theme;
    for (const one of this.#aircraft) {
      const { x, y } = projection.at({ latDeg: one.lat, lonDeg: one.lon });
      if (x < -20 || y < -20 || x > widthPx + 20 || y > heightPx + 20) continue;
      pen.save();
      pen.globalAlpha = one.age_s >= OLD_S ? 0.5 : 1;
      pen.translate(x, y);
      pen.rotate((one.course_deg ?? 0) * RADIANS);
      pen.beginPath();
      if (one.manned && one.course_deg !== null) for (const [across, along] of ARROW) pen.lineTo(across, along);
      else pen.rect(-6, -6, 12, 12);
      pen.closePath();
      pen.fillStyle = one.on_ground ? theme.gridText : theme.warning;
      pen.strokeStyle = theme.halo;
      pen.lineWidth = 2;
      pen.stroke();
      pen.fill();
      pen.restore();
      pen.textAlign = 'center';
      pen.textBaseline = 'middle';
      if (one.name) haloText(pen, theme, one.name, x, y + 18, `650 11px ${fontOf(pen)}`, theme.text);
      const words = aircraftWords(one, this.#ownAltM());
      haloText(pen, theme, words, x, y + (one.name ? 31 : 18), `500 11px ${fontOf(pen)}`, theme.text);
    }
  }
}

/** Draws other aircraft until the returned function is called. */
export function drawAircraft(
  map: MapLibreMap,
  aircraft: Readable<readonly Aircraft[]>,
  ownAltM: () => number | null,
): () => void {
  const overlay = new AircraftOverlay(map, ownAltM);
  const stop = aircraft.subscribe((list) => (overlay.aircraft = list));
  const stopTheme = onThemeChange(() => overlay.renewTheme());
  return () => {
    stop();
    stopTheme();
    overlay.remove();
  };
}
