/** Lines between drones that come near each other, with the distance. */

import type { NearLine } from '../link/separation';
import { fontOf, haloText } from './drone_marker';
import type { Projection } from './projection';
import type { MapTheme } from './theme';

const STRANGER_PX = 9;
const FONT_PX = 11;

export function drawNearLines(
  pen: CanvasRenderingContext2D,
  theme: MapTheme,
  projection: Projection,
  lines: readonly NearLine[],
): void {
  for (const { from, to, isWarning, label, isStranger } of lines) {
    const [start, end] = [projection.at(from), projection.at(to)];
    const colour = isWarning ? theme.states.alert : theme.warning;
    pen.strokeStyle = colour;
    pen.lineWidth = isWarning ? 3 : 2;
    pen.setLineDash(isWarning ? [] : [5, 4]);
    pen.beginPath();
    pen.moveTo(start.x, start.y);
    pen.lineTo(end.x, end.y);
    pen.stroke();
    pen.setLineDash([]);
    if (isStranger) {
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(end.x, end.y, STRANGER_PX, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.textAlign = 'center';
    pen.textBaseline = 'bottom';
    const [x, y] = [(start.x + end.x) / 2, Math.min(start.y, end.y) - 22];
    haloText(pen, theme, label, x, y, `600 ${FONT_PX}px ${fontOf(pen)}`, colour);
  }
}
