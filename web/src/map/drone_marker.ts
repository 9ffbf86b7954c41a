/** Draws one drone: an outline turned to its heading, a shape and a colour for its state, its name. */

import type { DroneState } from '../link/flight_values';
import type { MapTheme } from './theme';

export const MARKER_RADIUS_PX = 12;
/** Radius of the ring around a drone that flies without a holder. */
export const UNATTENDED_RADIUS_PX = MARKER_RADIUS_PX + 11;

type Pen = CanvasRenderingContext2D;

/** Points north; the caller has rotated the canvas. */
const OUTLINES: Record<DroneState, (pen: Pen, r: number) => void> = {
  // A full dart.
  flying(pen, r) {
    pen.moveTo(0, -r);
    pen.lineTo(r * 0.78, r * 0.85);
    pen.lineTo(0, r * 0.42);
    pen.lineTo(-r * 0.78, r * 0.85);
    pen.closePath();
  },
  // A triangle.
  armed(pen, r) {
    pen.moveTo(0, -r);
    pen.lineTo(r * 0.8, r * 0.7);
    pen.lineTo(-r * 0.8, r * 0.7);
    pen.closePath();
  },
  // A disc with a nose.
  idle(pen, r) {
    const half = 0.5;
    pen.arc(0, 0, r * 0.62, -Math.PI / 2 + half, -Math.PI / 2 - half + 2 * Math.PI);
    pen.lineTo(0, -r);
    pen.closePath();
  },
  // A square with a cross over it.
  lost(pen, r) {
    pen.rect(-r * 0.6, -r * 0.6, r * 1.2, r * 1.2);
    pen.moveTo(-r * 0.6, -r * 0.6);
    pen.lineTo(r * 0.6, r * 0.6);
    pen.moveTo(r * 0.6, -r * 0.6);
    pen.lineTo(-r * 0.6, r * 0.6);
  },
  // A diamond.
  alert(pen, r) {
    pen.moveTo(0, -r);
    pen.lineTo(r * 0.75, 0);
    pen.lineTo(0, r);
    pen.lineTo(-r * 0.75, 0);
    pen.closePath();
  },
};

/** The states drawn filled. */
const FILLED: ReadonlySet<DroneState> = new Set(['flying', 'armed', 'alert']);

export interface MarkerLook {
  readonly state: DroneState;
  readonly headingDeg: number;
  readonly name: string;
  readonly detail: string;
  readonly isSelected: boolean;
  readonly isUnattended?: boolean;
  readonly isStale?: boolean;
  readonly alarm?: 'critical' | 'warning';
}

export function drawMarker(pen: Pen, theme: MapTheme, x: number, y: number, look: MarkerLook): void {
  const colour = look.alarm === 'critical' ? theme.states.alert : theme.states[look.state];
  pen.save();
  pen.translate(x, y);
  if (look.isUnattended) {
    pen.beginPath();
    pen.arc(0, 0, UNATTENDED_RADIUS_PX, 0, 2 * Math.PI);
    pen.strokeStyle = theme.warning;
    pen.lineWidth = 3;
    pen.setLineDash([7, 5]);
    pen.stroke();
    pen.setLineDash([]);
  }
  if (look.alarm) {
    pen.beginPath();
    pen.arc(0, 0, MARKER_RADIUS_PX + 6, 0, 2 * Math.PI);
    pen.strokeStyle = look.alarm === 'critical' ? theme.states.alert : theme.warning;
    pen.lineWidth = 3;
    pen.stroke();
  }
  if (look.isStale && !look.alarm) pen.globalAlpha = 0.5;
  if (look.isSelected) {
    pen.beginPath();
    pen.arc(0, 0, MARKER_RADIUS_PX + 6, 0, 2 * Math.PI);
    pen.strokeStyle = theme.accent;
    pen.lineWidth = 2;
    pen.stroke();
  }
  pen.rotate((look.headingDeg * Math.PI) / 180);
  pen.beginPath();
  OUTLINES[look.state](pen, MARKER_RADIUS_PX);
  pen.lineJoin = 'round';
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 5;
  pen.stroke();
  pen.fillStyle = FILLED.has(look.state) ? colour : theme.halo;
  pen.fill();
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  pen.stroke();
  pen.restore();
}

type Words = Pick<MarkerLook, 'name' | 'detail'>;

const nameFont = (pen: Pen): string => `600 12px ${fontOf(pen)}`;
const detailFont = (pen: Pen): string => `500 11px ${fontOf(pen)}`;

export function labelSize(pen: Pen, { name, detail }: Words): { width: number; height: number } {
  const nameWidth = widthOf(pen, nameFont(pen), name);
  if (!detail) return { width: nameWidth, height: 16 };
  return { width: Math.max(nameWidth, widthOf(pen, detailFont(pen), detail)), height: 31 };
}

/** Texts repeat, and measuring one costs more than looking it up. */
const WIDTHS_KEPT = 4_000;
const widths = new Map<string, number>();

function widthOf(pen: Pen, font: string, text: string): number {
  const key = `${font}|${text}`;
  const known = widths.get(key);
  if (known !== undefined) return known;
  if (widths.size >= WIDTHS_KEPT) widths.clear();
  pen.font = font;
  const { width } = pen.measureText(text);
  widths.set(key, width);
  return width;
}

/** `x` is the left end, `y` the middle. */
export function drawLabel(pen: Pen, theme: MapTheme, x: number, y: number, { name, detail }: Words): void {
  pen.textBaseline = 'middle';
  pen.textAlign = 'left';
  pen.lineJoin = 'round';
  haloText(pen, theme, name, x, detail ? y - 7 : y, nameFont(pen), theme.text);
  if (detail) haloText(pen, theme, detail, x, y + 8, detailFont(pen), theme.gridText);
}

export function haloText(
  pen: Pen,
  theme: MapTheme,
  text: string,
  x: number,
  y: number,
  font: string,
  colour: string,
): void {
  pen.font = font;
  pen.strokeStyle = theme.halo;
  pen.lineWidth = 3.5;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
}

let family = '';
export function fontOf(pen: Pen): string {
  family ||= getComputedStyle(pen.canvas).fontFamily || 'sans-serif';
  return family;
}
