/** The canvas on which the parts of a squad mission are drawn, right above the ground: the area, each drone's strip and way in a colour of its own, conflicts. */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { Place } from '../link/messages';
import { fontOf, haloText } from './drone_marker';
import { Projection, type Point } from './projection';
import { readTheme, type MapTheme } from './theme';

/** Told apart by people with any kind of colour vision, light and dark; each has its drone's name beside it too. */
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
  readonly #map: MapLibreMap;
  readonly #canvas: HTMLCanvasElement;
  readonly #pen: CanvasRenderingContext2D;
  #theme: MapTheme = readTheme();
  #scene: SquadScene = NOTHING;
  #frame = 0;

  constructor(map: MapLibreMap) {
    this.#map = map;
    this.#canvas = document.createElement('canvas');
    this.#canvas.setAttribute('aria-hidden', 'true');
    Object.assign(this.#canvas.style, { position: 'absolute', inset: '0', pointerEvents: 'none' });
    map.getCanvas().after(this.#canvas);
    this.#pen = this.#canvas.getContext('2d')!;
    map.on('resize', this.#resize);
    map.on('render', this.#draw);
    this.#resize();
  }

  set scene(scene: SquadScene) {
    this.#scene = scene;
    this.#frame ||= requestAnimationFrame(this.#draw);
  }

  renewTheme(): void {
    this.#theme = readTheme();
    this.#frame ||= requestAnimationFrame(this.#draw);
  }

  remove(): void {
    cancelAnimationFrame(this.#frame);
    this.#map.off('resize', this.#resize);
    this.#map.off('render', this.#draw);
    this.#canvas.remove();
  }

  readonly #resize = (): void => {
    const { clientWidth, clientHeight } = this.#map.getContainer();
    const ratio = window.devicePixelRatio || 1;
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    Object.assign(this.#canvas.style, { width: `${clientWidth}px`, height: `${clientHeight}px` });
    this.#pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.#draw();
  };

  readonly #draw = (): void => {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const { clientWidth: widthPx, clientHeight: heightPx } = this.#map.getContainer();
    const { lat, lng } = this.#map.getCenter();
    const centre = { latDeg: lat, lonDeg: lng };
    const projection = new Projection({ centre, zoom: this.#map.getZoom(), widthPx, heightPx });
    const at = (place: Place): Point => projection.at(place);
    const [pen, theme] = [this.#pen, this.#theme];
    pen.clearRect(0, 0, widthPx, heightPx);
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
  };

  #drawArea(at: (place: Place) => Point): void {
    const { corners } = this.#scene;
    if (corners.length === 0) return;
    const [pen, theme] = [this.#pen, this.#theme];
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
    const [pen, theme] = [this.#pen, this.#theme];
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
    this.#pen.beginPath();
    for (const place of places) {
      const { x, y } = at(place);
      this.#pen.lineTo(x, y);
    }
  }
}
