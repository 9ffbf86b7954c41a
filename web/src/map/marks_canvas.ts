/** Draws what a person put on the map for themselves: a measured line, a searched place, their own position. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { distanceM } from '../link/geometry';
import type { Place } from '../link/messages';
import { ringPath } from './ground_signs';
import { MapCanvas, type Sheet } from './map_canvas';
import { readTheme, type MapTheme } from './theme';

export interface Marks {
  readonly measured: readonly Place[];
  readonly sought: Place | null;
  readonly own: (Place & { readonly accuracyM: number }) | null;
}

export const NO_MARKS: Marks = { measured: [], sought: null, own: null };

export const lengthM = (line: readonly Place[]): number =>
  line.slice(1).reduce((sum, place, at) => sum + distanceM(line[at]!, place), 0);

export class MarksCanvas {
  readonly #canvas: MapCanvas;
  #theme: MapTheme = readTheme();
  #marks: Marks = NO_MARKS;

  constructor(map: MapLibreMap) {
    this.#canvas = new MapCanvas(map, { paint: (sheet) => this.#paint(sheet) });
  }

  set marks(marks: Marks) {
    this.#marks = marks;
    this.#theme = readTheme();
    this.#canvas.soon();
  }

  remove(): void {
    this.#canvas.remove();
  }

  #paint({ pen, projection }: Sheet): void {
    const { measured, sought, own } = this.#marks;
    const theme = this.#theme;
    if (own) {
      const { x, y } = projection.at(own);
      pen.globalAlpha = 0.18;
      pen.fillStyle = theme.accent;
      pen.beginPath();
      ringPath(pen, projection, own, own.accuracyM);
      pen.fill();
      pen.globalAlpha = 1;
      disc(pen, x, y, 6, theme.accent, theme.halo);
    }
    if (measured.length > 0) {
      const points = measured.map((place) => projection.at(place));
      for (const [width, colour] of [
        [5, theme.halo],
        [2, theme.accent],
      ] as const) {
        pen.beginPath();
        for (const { x, y } of points) pen.lineTo(x, y);
        pen.lineWidth = width;
        pen.strokeStyle = colour;
        pen.stroke();
      }
      for (const { x, y } of points) disc(pen, x, y, 4, theme.accent, theme.halo);
    }
    if (sought) {
      const { x, y } = projection.at(sought);
      pen.lineWidth = 3;
      for (const [radius, colour] of [
        [11, theme.halo],
        [9, theme.warning],
      ] as const) {
        pen.strokeStyle = colour;
        pen.beginPath();
        pen.arc(x, y, radius, 0, 2 * Math.PI);
        pen.stroke();
      }
      disc(pen, x, y, 3, theme.warning, theme.halo);
    }
  }
}

function disc(pen: Sheet['pen'], x: number, y: number, radius: number, colour: string, edge: string): void {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = colour;
  pen.fill();
  pen.lineWidth = 2;
  pen.strokeStyle = edge;
  pen.stroke();
}
