/** On a tilted map: the line from each drone in the air down to the place under it. */

import type { DroneState } from '../link/flight_values';
import type { Place } from '../link/messages';
import type { Point, Projection } from './projection';
import type { MapTheme } from './theme';

const FOOT_PX = 3;

interface Flying {
  readonly drone: { readonly place: Place; readonly upM?: number; readonly state: DroneState };
  readonly at: Point;
}

export function drawStems(
  pen: CanvasRenderingContext2D,
  theme: MapTheme,
  projection: Projection,
  drones: readonly Flying[],
): void {
  for (const { drone, at } of drones) {
    if (!drone.upM) continue;
    const foot = projection.at(drone.place);
    pen.strokeStyle = pen.fillStyle = theme.states[drone.state];
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(at.x, at.y);
    pen.lineTo(foot.x, foot.y);
    pen.stroke();
    pen.beginPath();
    pen.ellipse(foot.x, foot.y, 2 * FOOT_PX, FOOT_PX, 0, 0, 2 * Math.PI);
    pen.fill();
  }
}
