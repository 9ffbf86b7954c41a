/** The symbols of a plan on the map: each kind of item has its own shape, and its number from the table. */

import { fontOf } from './drone_marker';
import type { SceneItem } from './plan_scene';
import type { Point } from './projection';
import type { MapTheme } from './theme';

type Pen = CanvasRenderingContext2D;

export const ITEM_RADIUS_PX = 11;
const DOT_PX = 3.5;

const OUTLINES: Record<SceneItem['sign'], (pen: Pen, r: number) => void> = {
  way: (pen, r) => pen.arc(0, 0, r, 0, 2 * Math.PI),
  loiter: (pen, r) => pen.arc(0, 0, r, 0, 2 * Math.PI),
  // A house pointing up.
  takeoff(pen, r) {
    pen.moveTo(0, -r * 1.35);
    pen.lineTo(r, -r * 0.35);
    pen.lineTo(r, r);
    pen.lineTo(-r, r);
    pen.lineTo(-r, -r * 0.35);
    pen.closePath();
  },
  // A house pointing down.
  land(pen, r) {
    pen.moveTo(0, r * 1.35);
    pen.lineTo(r, r * 0.35);
    pen.lineTo(r, -r);
    pen.lineTo(-r, -r);
    pen.lineTo(-r, r * 0.35);
    pen.closePath();
  },
  look(pen, r) {
    pen.moveTo(0, -r * 1.25);
    pen.lineTo(r * 1.25, 0);
    pen.lineTo(0, r * 1.25);
    pen.lineTo(-r * 1.25, 0);
    pen.closePath();
  },
};

/** `isDot`: no room for its number. `radiusPx`: radius of the circle that it flies. */
export function drawItem(
  pen: Pen,
  theme: MapTheme,
  { x, y }: Point,
  item: SceneItem,
  isDot: boolean,
  radiusPx: number,
): void {
  const fill = item.isCurrent ? theme.states.flying : item.isReached ? theme.done : theme.way;
  const ink = item.isCurrent ? theme.halo : item.isReached ? theme.onDone : theme.onWay;
  pen.save();
  pen.translate(x, y);
  if (isDot) {
    pen.beginPath();
    pen.arc(0, 0, DOT_PX, 0, 2 * Math.PI);
    pen.fillStyle = item.hasFault ? theme.danger : fill;
    pen.strokeStyle = item.isSelected ? theme.text : theme.halo;
    pen.lineWidth = item.isSelected ? 3 : 2;
    pen.stroke();
    pen.fill();
    pen.restore();
    return;
  }
  if (item.liftPx > 0) {
    pen.beginPath();
    pen.moveTo(0, ITEM_RADIUS_PX);
    pen.lineTo(0, item.liftPx - 9);
    pen.strokeStyle = fill;
    pen.lineWidth = 2;
    pen.stroke();
  }
  if (radiusPx > ITEM_RADIUS_PX) {
    pen.beginPath();
    pen.arc(0, 0, radiusPx, 0, 2 * Math.PI);
    pen.setLineDash([4, 5]);
    pen.strokeStyle = fill;
    pen.lineWidth = 1.5;
    pen.stroke();
    pen.setLineDash([]);
  }
  const ring = (r: number, colour: string, width: number): void => {
    pen.beginPath();
    OUTLINES[item.sign](pen, r);
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  };
  if (item.isCurrent) ring(ITEM_RADIUS_PX + 6, theme.states.flying, 2);
  if (item.isSelected) ring(ITEM_RADIUS_PX + 2.5, theme.text, 2.5);
  ring(ITEM_RADIUS_PX, theme.halo, 3);
  pen.beginPath();
  OUTLINES[item.sign](pen, ITEM_RADIUS_PX);
  pen.fillStyle = fill;
  pen.fill();
  if (item.sign === 'loiter') ring(ITEM_RADIUS_PX - 2.5, ink, 1);
  const size = item.label.length > 2 ? 9.5 : 11.5;
  pen.font = `650 ${size}px ${fontOf(pen)}`;
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.fillStyle = ink;
  pen.fillText(item.label, 0, item.sign === 'takeoff' ? 1.5 : item.sign === 'land' ? -0.5 : 0.5);
  if (item.hasFault) drawFault(pen, theme);
  pen.restore();
}

/** A small symbol at its corner, so that colour is not the only cue. */
function drawFault(pen: Pen, theme: MapTheme): void {
  pen.translate(ITEM_RADIUS_PX - 1, -ITEM_RADIUS_PX + 1);
  pen.beginPath();
  pen.arc(0, 0, 6, 0, 2 * Math.PI);
  pen.fillStyle = theme.danger;
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
  pen.fillStyle = theme.halo;
  pen.font = `800 9px ${fontOf(pen)}`;
  pen.fillText('!', 0, 0.5);
}

export function drawRally(
  pen: Pen,
  theme: MapTheme,
  { x, y }: Point,
  { label, isSelected }: { readonly label: string; readonly isSelected: boolean },
): void {
  pen.save();
  pen.translate(x, y);
  const outline = (r: number): void => {
    pen.beginPath();
    pen.roundRect(-r * 1.15, -r, r * 2.3, r * 2, 4);
  };
  if (isSelected) {
    outline(13);
    pen.strokeStyle = theme.text;
    pen.lineWidth = 2.5;
    pen.stroke();
  }
  outline(10.5);
  pen.fillStyle = theme.rally;
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 3;
  pen.stroke();
  pen.fill();
  pen.fillStyle = theme.onWay;
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.font = `650 11px ${fontOf(pen)}`;
  pen.fillText(label, 0, 0.5);
  pen.restore();
}

/** Where the drone flies after a fence breach. */
export function drawReturn(pen: Pen, theme: MapTheme, { x, y }: Point): void {
  pen.save();
  pen.translate(x, y);
  pen.strokeStyle = theme.good;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(0, 0, 8, 0, 2 * Math.PI);
  pen.moveTo(-4, 0);
  pen.lineTo(4, 0);
  pen.moveTo(0, -4);
  pen.lineTo(0, 4);
  pen.stroke();
  pen.restore();
}

/** Where an outline crosses itself. */
export function drawCrossing(pen: Pen, theme: MapTheme, { x, y }: Point): void {
  pen.save();
  pen.translate(x, y);
  pen.strokeStyle = theme.danger;
  pen.lineWidth = 3;
  pen.beginPath();
  pen.arc(0, 0, 11, 0, 2 * Math.PI);
  pen.moveTo(-5, -5);
  pen.lineTo(5, 5);
  pen.moveTo(-5, 5);
  pen.lineTo(5, -5);
  pen.stroke();
  pen.restore();
}

export function drawHandle(
  pen: Pen,
  theme: MapTheme,
  { x, y }: Point,
  kind: 'corner' | 'plus' | 'home' | 'begin' | 'end',
  isChosen: boolean,
): void {
  pen.save();
  pen.translate(x, y);
  pen.beginPath();
  pen.lineWidth = 1.5;
  if (kind === 'home') {
    // A house, as on every map of the console.
    pen.moveTo(0, -9);
    pen.lineTo(9, -1);
    pen.lineTo(6, -1);
    pen.lineTo(6, 8);
    pen.lineTo(-6, 8);
    pen.lineTo(-6, -1);
    pen.lineTo(-9, -1);
    pen.closePath();
    pen.fillStyle = theme.halo;
    pen.strokeStyle = theme.home;
  } else if (kind === 'plus') {
    pen.arc(0, 0, 7, 0, 2 * Math.PI);
    pen.fillStyle = theme.halo;
    pen.strokeStyle = theme.gridText;
  } else if (kind === 'corner') {
    pen.rect(-5.5, -5.5, 11, 11);
    pen.fillStyle = isChosen ? theme.accent : theme.halo;
    pen.strokeStyle = theme.accent;
    pen.lineWidth = 2;
  } else {
    pen.arc(0, 0, 6, 0, 2 * Math.PI);
    pen.fillStyle = kind === 'begin' ? theme.way : theme.halo;
    pen.strokeStyle = theme.way;
    pen.lineWidth = 2;
  }
  pen.fill();
  pen.stroke();
  if (kind === 'plus') {
    pen.beginPath();
    pen.moveTo(-3.5, 0);
    pen.lineTo(3.5, 0);
    pen.moveTo(0, -3.5);
    pen.lineTo(0, 3.5);
    pen.stroke();
  }
  pen.restore();
}
