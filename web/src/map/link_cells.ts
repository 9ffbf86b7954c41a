/** The quality of links by place: coloured cells directly above the ground, below the drones. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import { gradeOf, type LinkMeasure, type LinkPlace } from '../link/link_places';
import { cellWords } from '../words/link_place_words';
import { fontOf, haloText } from './drone_marker';
import { GRADE_COLOURS } from './link_colours';
import { MapCanvas, type Pen, type Sheet } from './map_canvas';
import { onThemeChange, readTheme, type MapTheme } from './theme';

/** Below it the figure would be wider than its cell. */
const FIGURE_FROM_PX = 52;
/** Below it a cross would hide the colour. */
const CROSS_FROM_PX = 14;
/** A cell that is smaller than this would vanish. */
const MIN_PX = 3;

interface Box {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export class LinkCells {
  readonly #canvas: MapCanvas;
  readonly #stopTheme: () => void;
  #theme: MapTheme = readTheme();
  #places: readonly LinkPlace[] = [];
  #measure: LinkMeasure = 'loss';
  #chosen: LinkPlace | null = null;

  constructor(map: MapLibreMap) {
    this.#canvas = new MapCanvas(map, { isLowest: true, testId: 'link-cells', paint: (sheet) => this.#draw(sheet) });
    this.#stopTheme = onThemeChange(() => {
      this.#theme = readTheme();
      this.#canvas.soon();
    });
  }

  show(places: readonly LinkPlace[], measure: LinkMeasure, chosen: LinkPlace | null): void {
    [this.#places, this.#measure, this.#chosen] = [places, measure, chosen];
    this.#canvas.soon();
  }

  remove(): void {
    this.#stopTheme();
    this.#canvas.remove();
  }

  #draw({ pen, projection, widthPx, heightPx }: Sheet): void {
    pen.save();
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    for (const place of this.#places) {
      const { x, y } = projection.at({ latDeg: place.north, lonDeg: place.west });
      const corner = projection.at({ latDeg: place.south, lonDeg: place.east });
      const [width, height] = [Math.max(MIN_PX, corner.x - x), Math.max(MIN_PX, corner.y - y)];
      if (x > widthPx || y > heightPx || x + width < 0 || y + height < 0) continue;
      this.#drawCell(pen, place, { x, y, width, height });
    }
    pen.restore();
  }

  #drawCell(pen: Pen, place: LinkPlace, { x, y, width, height }: Box): void {
    const grade = gradeOf(place, this.#measure);
    if (grade) {
      pen.globalAlpha = 0.82;
      pen.fillStyle = GRADE_COLOURS[grade];
      pen.fillRect(x, y, width, height);
    }
    const isChosen = place === this.#chosen;
    pen.globalAlpha = isChosen ? 1 : grade ? 0.45 : 0.8;
    pen.strokeStyle = this.#theme.text;
    pen.lineWidth = isChosen ? 3 : 1;
    pen.setLineDash(grade || isChosen ? [] : [3, 3]);
    pen.strokeRect(x + 0.5, y + 0.5, width - 1, height - 1);
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    if (place.losses > 0 && width >= CROSS_FROM_PX) this.#drawCross(pen, x + width - 7, y + 7);
    if (width < FIGURE_FROM_PX) return;
    const words = cellWords(this.#measure, place);
    haloText(pen, this.#theme, words, x + width / 2, y + height / 2, `650 12px ${fontOf(pen)}`, this.#theme.text);
  }

  /** The link was lost here. */
  #drawCross(pen: Pen, x: number, y: number): void {
    for (const [colour, lineWidth] of [
      [this.#theme.halo, 4],
      [this.#theme.text, 2],
    ] as const) {
      pen.beginPath();
      pen.moveTo(x - 3, y - 3);
      pen.lineTo(x + 3, y + 3);
      pen.moveTo(x + 3, y - 3);
      pen.lineTo(x - 3, y + 3);
      pen.strokeStyle = colour;
      pen.lineWidth = lineWidth;
      pen.stroke();
    }
  }
}
