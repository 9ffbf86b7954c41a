/** Zones on every map: directly above the ground, below plans and drones. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { Place } from '../link/messages';
import type { Readable } from '../link/store';
import type { Zone } from '../link/zones';
import { heightWords } from '../words/zone_words';
import { fontOf, haloText } from './drone_marker';
import { MapCanvas, type Sheet } from './map_canvas';
import type { Point } from './projection';
import { onThemeChange, readTheme, type MapTheme } from './theme';

/** Below it a name would be larger than its zone. */
const NAMED_FROM_PX = 40;

export interface DrawnZone extends Pick<Zone, 'kind' | 'rule' | 'points'> {
  readonly name: string;
  readonly words: string;
  readonly widthM: number | null;
  readonly isDraft?: boolean;
}

const isNow = ({ valid_until: until }: Zone): boolean => !until || Date.parse(until) > Date.now();
const drawn = (zone: Zone): DrawnZone => ({ ...zone, words: heightWords(zone), widthM: zone.width_m ?? null });

export class ZonesOverlay {
  readonly #canvas: MapCanvas;
  #theme: MapTheme = readTheme();
  #zones: readonly DrawnZone[] = [];

  constructor(map: MapLibreMap) {
    this.#canvas = new MapCanvas(map, { isLowest: true, testId: 'zones-canvas', paint: (sheet) => this.#draw(sheet) });
  }

  set zones(zones: readonly DrawnZone[]) {
    this.#zones = zones;
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
    for (const zone of this.#zones) {
      const at = zone.points.map(([latDeg, lonDeg]): Point => projection.at({ latDeg, lonDeg } satisfies Place));
      const xs = at.map(({ x }) => x);
      const ys = at.map(({ y }) => y);
      const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
      const line = zone.widthM === null ? 0 : this.#widthPx(zone, at);
      if (right < -line || left > widthPx + line || bottom < -line || top > heightPx + line) continue;
      this.#drawZone(zone, at, line);
      if (right - left < NAMED_FROM_PX && bottom - top < NAMED_FROM_PX && line < NAMED_FROM_PX) continue;
      pen.textAlign = 'center';
      pen.textBaseline = 'middle';
      const [x, y] = [(left + right) / 2, (top + bottom) / 2];
      haloText(pen, this.#theme, zone.name, x, y - 7, `650 12px ${fontOf(pen)}`, this.#theme.text);
      haloText(pen, this.#theme, zone.words, x, y + 7, `500 11px ${fontOf(pen)}`, this.#theme.text);
    }
  }

  #drawZone(zone: DrawnZone, at: readonly Point[], linePx: number): void {
    const [pen, theme] = [this.#canvas.pen, this.#theme];
    const colour = zone.kind === 'corridor' ? theme.good : zone.rule === 'warn' ? theme.warning : theme.danger;
    pen.save();
    pen.lineJoin = pen.lineCap = 'round';
    pen.beginPath();
    for (const { x, y } of at) pen.lineTo(x, y);
    if (zone.widthM === null) {
      if (at.length > 2) pen.closePath();
      pen.globalAlpha = zone.kind === 'no-fly' ? 0.16 : 0.08;
      pen.fillStyle = colour;
      pen.fill();
    } else {
      pen.globalAlpha = 0.16;
      pen.strokeStyle = colour;
      pen.lineWidth = Math.max(2, linePx);
      pen.stroke();
    }
    pen.globalAlpha = 1;
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.setLineDash(zone.isDraft ? [4, 4] : zone.kind === 'no-fly' ? [] : [10, 5]);
    pen.stroke();
    if (zone.isDraft) {
      pen.setLineDash([]);
      for (const { x, y } of at) pen.strokeRect(x - 4, y - 4, 8, 8);
    }
    pen.restore();
  }

  /** A line's width in pixels, by the first two points of the zone: the scale is the same everywhere on screen. */
  #widthPx({ points, widthM }: DrawnZone, at: readonly Point[]): number {
    const [from, to] = [points[0], points[1]];
    if (!from || !to || !at[0] || !at[1] || widthM === null) return 0;
    const north = (to[0] - from[0]) * 111_319.5;
    const east = (to[1] - from[1]) * 111_319.5 * Math.cos((from[0] * Math.PI) / 180);
    const lengthM = Math.hypot(north, east);
    return lengthM > 0 ? (widthM * Math.hypot(at[1].x - at[0].x, at[1].y - at[0].y)) / lengthM : 0;
  }
}

/** Draws the user's zones until the returned function is called. Zones that are over are not drawn. */
export function drawZones(map: MapLibreMap, zones: Readable<readonly Zone[]>): () => void {
  const overlay = new ZonesOverlay(map);
  const stop = zones.subscribe((list) => (overlay.zones = list.filter(isNow).map(drawn)));
  const stopTheme = onThemeChange(() => overlay.renewTheme());
  return () => {
    stop();
    stopTheme();
    overlay.remove();
  };
}
