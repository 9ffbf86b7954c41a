/**
 * The canvas of a squad mission's parts, directly above the ground: the area, each drone's strip and path in its own
 * colour, conflicts.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { Place } from '../link/messages';
import { fontOf, haloText } from './drone_marker';
import { MapCanvas, type Sheet } from './map_canvas';
import type { Point } from './projection';
import { readTheme, type MapTheme } from './theme';

/** Distinguishable with any kind of colour vision, light and dark; each also has its drone's name beside it. */
export const SQUAD_COLOURS = [
  '#e69f00',
  '#56b4e9',
  '#00b386',
  '#d95f9a',
  '#b0a000',
  '#8c7ae6',
  '#e0603a',
  '#3fa7a7',
] as const;
export const colourOf = (at: number): string => SQUAD_COLOURS[at % SQUAD_COLOURS.length]!;

export interface SquadWay {
  readonly name: string;
  readonly colour: string;
  readonly way: readonly Place[];
  readonly area: readonly Place[];
}

export interface SquadScene {
  readonly corners: readonly Place[];
  readonly ways: readonly SquadWay[];
  readonly conflicts: readonly { readonly place: Place; readonly isError: boolean }[];
}

const NOTHING: SquadScene = { corners: [], ways: [], conflicts: [] };

export class SquadOverlay {
  readonly #canvas: MapCanvas;
  #theme: MapTheme = readTheme();
  #scene: SquadScene = NOTHING;

  constructor(map: MapLibreMap) {
    this.#canvas = new MapCanvas(map, { isLowest: true, paint: (sheet) => this.#draw(sheet) });
  }

  set scene(scene: SquadScene) {
    this.#scene = scene;
    this.#canvas.soon();
  }

  renewTheme(): void {
    this.#theme = readTheme();
    this.#canvas.soon();
  }

  remove(): void {
    this.#canvas.remove();
  }

  #draw({ pen, projection }: Sheet): void {
    const at = (place: Place): Point => projection.at(place);
    const theme = this.#theme;
    pen.lineJoin = pen.lineCap = 'round';
    this.#drawArea(at);
    for (const one of this.#scene.ways) this.#drawWay(one, at);
    for (const { place, isError } of this.#scene.conflicts) {
      const { x, y } = at(place);
      pen.beginPath();
      pen.arc(x, y, 11, 0, 2 * Math.PI);
      pen.strokeStyle = isError ? theme.states.alert : theme.warning;
      pen.lineWidth = 3;
      pen.stroke();
      pen.textAlign = 'center';
      pen.textBaseline = 'middle';
      haloText(pen, theme, '!', x, y, `700 13px ${fontOf(pen)}`, pen.strokeStyle);
    }
  }

  #drawArea(at: (place: Place) => Point): void {
    const { corners } = this.#scene;
    if (corners.length === 0) return;
    const [pen, theme] = [this.#canvas.pen, this.#theme];
    this.#trace(corners, at);
    if (corners.length > 2) pen.closePath();
    pen.strokeStyle = theme.accent;
    pen.lineWidth = 2;
    pen.setLineDash([6, 5]);
    pen.stroke();
    pen.setLineDash([]);
    for (const corner of corners) {
      const { x, y } = at(corner);
      pen.beginPath();
      pen.rect(x - 4, y - 4, 8, 8);
      pen.fillStyle = theme.halo;
      pen.fill();
      pen.stroke();
    }
  }

  #drawWay({ name, colour, way, area }: SquadWay, at: (place: Place) => Point): void {
    const [pen, theme] = [this.#canvas.pen, this.#theme];
    if (area.length > 2) {
      this.#trace(area, at);
      pen.closePath();
      pen.save();
      pen.globalAlpha = 0.14;
      pen.fillStyle = colour;
      pen.fill();
      pen.restore();
    }
    this.#trace(way, at);
    pen.strokeStyle = theme.halo;
    pen.lineWidth = 4.5;
    pen.stroke();
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.stroke();
    const named = area.length > 2 ? area : way;
    if (named.length === 0) return;
    const points = named.map(at);
    const x = points.reduce((sum, point) => sum + point.x, 0) / points.length;
    const y = points.reduce((sum, point) => sum + point.y, 0) / points.length;
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    haloText(pen, theme, name, x, y, `650 13px ${fontOf(pen)}`, theme.text);
  }

  #trace(places: readonly Place[], at: (place: Place) => Point): void {
    const { pen } = this.#canvas;
    pen.beginPath();
    for (const place of places) {
      const { x, y } = at(place);
      pen.lineTo(x, y);
    }
  }
}
