/**
 * The canvas over the map on which everything that moves is drawn: drones, tracks, home, target, grid. MapLibre
 * redraws its whole map for each change of a symbol source; this costs a third to a quarter of that.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { DroneState } from '../link/flight_values';
import { offsetBy } from '../link/geometry';
import type { Place } from '../link/messages';
import { drawMarker, fontOf, haloText, MARKER_RADIUS_PX } from './drone_marker';
import { drawLabels } from './drone_labels';
import { drawGraticule } from './graticule';
import { readTheme, type MapTheme } from './theme';

const HIT_RADIUS_PX = MARKER_RADIUS_PX + 8;
const LABEL_MARGIN_PX = 160;
/** The grid has its labels there. */
const GRID_LABELS_PX = 28;

export interface SceneDrone {
  readonly id: number;
  readonly name: string;
  readonly detail: string;
  readonly place: Place;
  readonly headingDeg: number;
  readonly state: DroneState;
  readonly track: readonly Place[];
}

export interface Scene {
  readonly drones: readonly SceneDrone[];
  readonly selectedId: number | null;
  readonly home: Place | null;
  readonly target: { readonly place: Place; readonly from: Place | null; readonly label: string } | null;
  /** Where a pick by keyboard would fall: the middle of the map. */
  readonly showsAim: boolean;
}

const EMPTY: Scene = { drones: [], selectedId: null, home: null, target: null, showsAim: false };

export class Overlay {
  readonly #map: MapLibreMap;
  readonly #canvas: HTMLCanvasElement;
  readonly #pen: CanvasRenderingContext2D;
  #theme: MapTheme = readTheme();
  #scene: Scene = EMPTY;
  #frame = 0;
  #labelSlots: ReadonlyMap<number, number> = new Map();

  constructor(map: MapLibreMap) {
    this.#map = map;
    this.#canvas = document.createElement('canvas');
    this.#canvas.setAttribute('aria-hidden', 'true');
    Object.assign(this.#canvas.style, { position: 'absolute', inset: '0', pointerEvents: 'none' });
    map.getCanvasContainer().append(this.#canvas);
    this.#pen = this.#canvas.getContext('2d')!;
    map.on('resize', () => this.#resize());
    // In the same frame as the map, so that markers do not swim behind it.
    map.on('render', () => this.#draw());
    this.#resize();
  }

  set scene(scene: Scene) {
    this.#scene = scene;
    this.#frame ||= requestAnimationFrame(() => this.#draw());
  }

  renewTheme(): void {
    this.#theme = readTheme();
  }

  /** The drone whose marker is at this point of the map, the nearest first. */
  droneAt(x: number, y: number): number | null {
    let nearest: { id: number; away: number } | null = null;
    for (const { id, place } of this.#scene.drones) {
      const at = this.#at(place);
      const away = Math.hypot(at.x - x, at.y - y);
      if (away <= HIT_RADIUS_PX && away < (nearest?.away ?? Infinity)) nearest = { id, away };
    }
    return nearest?.id ?? null;
  }

  remove(): void {
    cancelAnimationFrame(this.#frame);
    this.#canvas.remove();
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.#map.getContainer();
    const ratio = window.devicePixelRatio || 1;
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    Object.assign(this.#canvas.style, { width: `${clientWidth}px`, height: `${clientHeight}px` });
    this.#pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.#draw();
  }

  #at({ latDeg, lonDeg }: Place): { x: number; y: number } {
    return this.#map.project([lonDeg, latDeg]);
  }

  #draw(): void {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const { clientWidth: width, clientHeight: height } = this.#map.getContainer();
    const pen = this.#pen;
    pen.clearRect(0, 0, width, height);
    drawGraticule(pen, this.#map, this.#theme);
    const { drones, selectedId, home, target, showsAim } = this.#scene;
    if (home) this.#drawHome(home);
    for (const drone of drones) this.#drawTrack(drone);
    if (target) this.#drawTarget(target);
    const isNear = ({ x, y }: { x: number; y: number }): boolean =>
      x > -LABEL_MARGIN_PX && y > -MARKER_RADIUS_PX && x < width + MARKER_RADIUS_PX && y < height + MARKER_RADIUS_PX;
    const near = drones.map((drone) => ({ drone, at: this.#at(drone.place) })).filter(({ at }) => isNear(at));
    for (const { drone, at } of near) {
      drawMarker(pen, this.#theme, at.x, at.y, { ...drone, isSelected: drone.id === selectedId });
    }
    this.#labelSlots = drawLabels(pen, this.#theme, near, selectedId, this.#labelSlots);
    if (showsAim) this.#drawAim(width / 2, height / 2);
  }

  #drawTrack({ track, place, state }: SceneDrone): void {
    if (track.length === 0) return;
    const pen = this.#pen;
    pen.beginPath();
    for (const [index, point] of [...track, place].entries()) {
      const { x, y } = this.#at(point);
      if (index === 0) pen.moveTo(x, y);
      else pen.lineTo(x, y);
    }
    pen.strokeStyle = this.#theme.states[state];
    pen.globalAlpha = 0.55;
    pen.lineWidth = 2;
    pen.lineJoin = 'round';
    pen.stroke();
    pen.globalAlpha = 1;
  }

  #drawHome(home: Place): void {
    const { x, y } = this.#at(home);
    const pen = this.#pen;
    // Rings of distance round home.
    for (const radiusM of ringsM(this.#map, home)) {
      const edge = this.#at(offsetBy(home, radiusM, 0));
      pen.setLineDash([2, 5]);
      pen.strokeStyle = this.#theme.gridText;
      pen.lineWidth = 1;
      pen.globalAlpha = 0.6;
      pen.beginPath();
      pen.arc(x, y, Math.abs(edge.y - y), 0, 2 * Math.PI);
      pen.stroke();
      pen.globalAlpha = 1;
      pen.setLineDash([]);
      if (edge.y < GRID_LABELS_PX) continue;
      const label = radiusM >= 1000 ? `${radiusM / 1000} km` : `${radiusM} m`;
      pen.textAlign = 'center';
      pen.textBaseline = 'middle';
      haloText(pen, this.#theme, label, x, edge.y, `500 10px ${fontOf(pen)}`, this.#theme.gridText);
    }
    // A house.
    pen.beginPath();
    pen.moveTo(x, y - 8);
    pen.lineTo(x + 8, y - 1);
    pen.lineTo(x + 5.5, y - 1);
    pen.lineTo(x + 5.5, y + 7);
    pen.lineTo(x - 5.5, y + 7);
    pen.lineTo(x - 5.5, y - 1);
    pen.lineTo(x - 8, y - 1);
    pen.closePath();
    pen.strokeStyle = this.#theme.home;
    pen.fillStyle = this.#theme.halo;
    pen.lineWidth = 1.5;
    pen.fill();
    pen.stroke();
  }

  #drawTarget({ place, from, label }: NonNullable<Scene['target']>): void {
    const { x, y } = this.#at(place);
    const pen = this.#pen;
    pen.strokeStyle = this.#theme.target;
    pen.lineWidth = 1.5;
    if (from) {
      const start = this.#at(from);
      pen.setLineDash([6, 5]);
      pen.beginPath();
      pen.moveTo(start.x, start.y);
      pen.lineTo(x, y);
      pen.stroke();
      pen.setLineDash([]);
    }
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 9, 0, 2 * Math.PI);
    pen.moveTo(x - 14, y);
    pen.lineTo(x + 14, y);
    pen.moveTo(x, y - 14);
    pen.lineTo(x, y + 14);
    pen.stroke();
    pen.textAlign = 'left';
    pen.textBaseline = 'middle';
    haloText(pen, this.#theme, label, x + 16, y - 10, `600 11px ${fontOf(pen)}`, this.#theme.target);
  }

  #drawAim(x: number, y: number): void {
    const pen = this.#pen;
    pen.strokeStyle = this.#theme.target;
    pen.lineWidth = 1.5;
    pen.strokeRect(x - 10, y - 10, 20, 20);
    pen.beginPath();
    pen.moveTo(x - 4, y);
    pen.lineTo(x + 4, y);
    pen.moveTo(x, y - 4);
    pen.lineTo(x, y + 4);
    pen.stroke();
  }
}

/** Two or three round distances that fit on the screen. */
function ringsM(map: MapLibreMap, home: Place): number[] {
  const metresPerPx = (40_075_016.7 * Math.cos((home.latDeg * Math.PI) / 180)) / (512 * 2 ** map.getZoom());
  const wantedM = metresPerPx * 110;
  const unit = 10 ** Math.floor(Math.log10(wantedM));
  const step = [1, 2, 5, 10].map((times) => times * unit).find((one) => one >= wantedM) ?? wantedM;
  // A ring over half a continent says nothing about a drone.
  return step > 5_000 ? [] : [step, 2 * step, 3 * step];
}
