/** Ground symbols of the map: home with range rings, the place a drone flies to, the aim. */

import { offsetBy } from '../link/geometry';
import type { Place } from '../link/messages';
import { fontOf, haloText } from './drone_marker';
import type { Box } from './obstacles';
import type { Projection } from './projection';
import type { MapTheme } from './theme';

type Pen = CanvasRenderingContext2D;

/** Area of the grid's labels. */
const GRID_LABELS_PX = 28;
const RING_WANTED_PX = 110;
const RING_CORNERS = 64;
export const HOME_RADIUS_PX = 8;

export function drawHome(
  pen: Pen,
  theme: MapTheme,
  projection: Projection,
  home: Place,
  words: (metres: number) => string,
): void {
  const { x, y } = projection.at(home);
  for (const radiusM of ringsM(projection, home)) {
    const edge = projection.at(offsetBy(home, radiusM, 0));
    pen.setLineDash([2, 5]);
    pen.strokeStyle = theme.gridText;
    pen.lineWidth = 1;
    pen.globalAlpha = 0.6;
    pen.beginPath();
    ringPath(pen, projection, home, radiusM);
    pen.stroke();
    pen.globalAlpha = 1;
    pen.setLineDash([]);
    if (edge.y < GRID_LABELS_PX) continue;
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    haloText(pen, theme, words(radiusM), x, edge.y, `500 10px ${fontOf(pen)}`, theme.gridText);
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
  pen.strokeStyle = theme.home;
  pen.fillStyle = theme.halo;
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
}

/** Adds a circle on the ground to the path of the pen. */
export function ringPath(pen: Pen, projection: Projection, centre: Place, radiusM: number): void {
  const { x, y } = projection.at(centre);
  if (!projection.isTilted) {
    pen.arc(x, y, Math.abs(projection.at(offsetBy(centre, radiusM, 0)).y - y), 0, 2 * Math.PI);
    return;
  }
  for (let corner = 0; corner < RING_CORNERS; corner += 1) {
    const angle = (2 * Math.PI * corner) / RING_CORNERS;
    const at = projection.at(offsetBy(centre, radiusM * Math.cos(angle), radiusM * Math.sin(angle)));
    pen.lineTo(at.x, at.y);
  }
  pen.closePath();
}

export interface MapTarget {
  readonly place: Place;
  readonly from: Place | null;
  readonly label: string;
}

const TARGET_RADIUS_PX = 14;
const TARGET_FONT_PX = 11;

/** Returns the boxes of its text and its symbol, so that no label covers them. */
export function drawTarget(
  pen: Pen,
  theme: MapTheme,
  projection: Projection,
  { place, from, label }: MapTarget,
): readonly Box[] {
  const { x, y } = projection.at(place);
  pen.strokeStyle = theme.target;
  pen.lineWidth = 1.5;
  if (from) {
    const start = projection.at(from);
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
  pen.moveTo(x - TARGET_RADIUS_PX, y);
  pen.lineTo(x + TARGET_RADIUS_PX, y);
  pen.moveTo(x, y - TARGET_RADIUS_PX);
  pen.lineTo(x, y + TARGET_RADIUS_PX);
  pen.stroke();
  pen.textAlign = 'left';
  pen.textBaseline = 'middle';
  pen.font = `600 ${TARGET_FONT_PX}px ${fontOf(pen)}`;
  const width = pen.measureText(label).width;
  // On the side away from the drone: its line and its own name are on the other side.
  const start = from && projection.at(from);
  const left = start && start.x > x ? x - TARGET_RADIUS_PX - 2 - width : x + TARGET_RADIUS_PX + 2;
  const middle = start && start.y < y ? y + 10 : y - 10;
  haloText(pen, theme, label, left, middle, pen.font, theme.target);
  return [
    { left, right: left + width, top: middle - TARGET_FONT_PX, bottom: middle + TARGET_FONT_PX },
    {
      left: x - TARGET_RADIUS_PX,
      right: x + TARGET_RADIUS_PX,
      top: y - TARGET_RADIUS_PX,
      bottom: y + TARGET_RADIUS_PX,
    },
  ];
}

export function drawAim(pen: Pen, theme: MapTheme, x: number, y: number): void {
  pen.strokeStyle = theme.target;
  pen.lineWidth = 1.5;
  pen.strokeRect(x - 10, y - 10, 20, 20);
  pen.beginPath();
  pen.moveTo(x - 4, y);
  pen.lineTo(x + 4, y);
  pen.moveTo(x, y - 4);
  pen.lineTo(x, y + 4);
  pen.stroke();
}

/** Two or three round distances that fit on the screen. */
function ringsM(projection: Projection, home: Place): number[] {
  const pxPerKm = Math.abs(projection.at(offsetBy(home, 1000, 0)).y - projection.at(home).y);
  const wantedM = (RING_WANTED_PX / pxPerKm) * 1000;
  const unit = 10 ** Math.floor(Math.log10(wantedM));
  const step = [1, 2, 5, 10].map((times) => times * unit).find((one) => one >= wantedM) ?? wantedM;
  // A ring across half a continent says nothing about a drone.
  return step > 5_000 ? [] : [step, 2 * step, 3 * step];
}
