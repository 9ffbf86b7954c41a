/** Draws a cluster: a disc with the number of its drones and a ring that shows their states. */

import type { DroneState } from '../link/flight_values';
import { fontOf } from './drone_marker';
import type { MapTheme } from './theme';

export const CLUSTER_DISC_PX = 15;

const ORDER: readonly DroneState[] = ['alert', 'flying', 'armed', 'lost', 'idle'];

export function drawCluster(
  pen: CanvasRenderingContext2D,
  theme: MapTheme,
  x: number,
  y: number,
  states: readonly DroneState[],
): void {
  pen.beginPath();
  pen.arc(x, y, CLUSTER_DISC_PX + 4, 0, 2 * Math.PI);
  pen.fillStyle = theme.halo;
  pen.fill();
  const share = (2 * Math.PI) / states.length;
  let from = -Math.PI / 2;
  pen.lineWidth = 4;
  for (const state of ORDER) {
    const count = states.filter((one) => one === state).length;
    if (count === 0) continue;
    pen.beginPath();
    pen.arc(x, y, CLUSTER_DISC_PX, from, from + count * share);
    pen.strokeStyle = theme.states[state];
    pen.stroke();
    from += count * share;
  }
  pen.font = `650 12px ${fontOf(pen)}`;
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.fillStyle = theme.text;
  pen.fillText(String(states.length), x, y);
}
