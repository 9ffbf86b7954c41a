/** What controllers on board have found, on the map of a drone's own page: a square with the letter at its place. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { Finding } from '../link/findings';
import { letterOf } from '../words/controller_words';
import { fontOf, haloText } from './drone_marker';
import { MapCanvas, type Sheet } from './map_canvas';
import { onThemeChange, readTheme, type MapTheme } from './theme';

const HALF_PX = 9;
const BEYOND_PX = 30;

export class FindingsLayer {
  readonly #canvas: MapCanvas;
  readonly #stopTheme: () => void;
  #theme: MapTheme = readTheme();
  #findings: readonly Finding[] = [];

  constructor(map: MapLibreMap) {
    this.#canvas = new MapCanvas(map, { testId: 'findings-canvas', paint: (sheet) => this.#paint(sheet) });
    this.#stopTheme = onThemeChange(() => {
      this.#theme = readTheme();
      this.#canvas.soon();
    });
  }

  /** Newest first. */
  set findings(findings: readonly Finding[]) {
    this.#findings = findings;
    this.#canvas.soon();
  }

  remove(): void {
    this.#stopTheme();
    this.#canvas.remove();
  }

  #paint({ pen, projection, widthPx, heightPx }: Sheet): void {
    const theme = this.#theme;
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    // The newest is drawn last, over the others.
    for (const finding of [...this.#findings].reverse()) {
      const { x, y } = projection.at({ latDeg: finding.lat_deg, lonDeg: finding.lon_deg });
      if (x < -BEYOND_PX || y < -BEYOND_PX || x > widthPx + BEYOND_PX || y > heightPx + BEYOND_PX) continue;
      pen.beginPath();
      pen.rect(x - HALF_PX, y - HALF_PX, 2 * HALF_PX, 2 * HALF_PX);
      pen.fillStyle = theme.halo;
      pen.fill();
      for (const [width, colour] of [
        [5, theme.halo],
        [2, theme.accent],
      ] as const) {
        pen.lineWidth = width;
        pen.strokeStyle = colour;
        pen.stroke();
      }
      haloText(pen, theme, letterOf(finding), x, y + 0.5, `700 12px ${fontOf(pen)}`, theme.text);
    }
  }
}
