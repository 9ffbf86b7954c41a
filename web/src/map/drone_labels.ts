/** Draws the drones' names beside their markers; the most important ones are placed first. */

import type { DroneState } from '../link/flight_values';
import { drawLabel, labelSize, MARKER_RADIUS_PX, UNATTENDED_RADIUS_PX } from './drone_marker';
import { layoutLabels } from './label_layout';
import type { Box } from './obstacles';
import type { MapTheme } from './theme';

const RADIUS_PX = MARKER_RADIUS_PX + 8;
const RANK: Record<DroneState, number> = { alert: 1, flying: 2, armed: 3, lost: 4, idle: 5 };

interface Named {
  readonly drone: {
    readonly id: number;
    readonly name: string;
    readonly detail: string;
    readonly state: DroneState;
    readonly isUnattended?: boolean;
    readonly alarm?: 'critical' | 'warning';
  };
  readonly at: { readonly x: number; readonly y: number };
}

/** Avoids what is `inTheWay`. Returns the slots for the next drawing. */
export function drawLabels(
  pen: CanvasRenderingContext2D,
  theme: MapTheme,
  drones: readonly Named[],
  selectedId: number | null,
  last: ReadonlyMap<number, number>,
  inTheWay: readonly Box[],
): ReadonlyMap<number, number> {
  const rank = ({ drone }: Named): number => (drone.id === selectedId ? 0 : drone.alarm ? 0.5 : RANK[drone.state]);
  const ordered = [...drones].sort((a, b) => rank(a) - rank(b) || a.drone.id - b.drone.id);
  const wanted = ordered.map(({ drone, at }) => ({
    id: drone.id,
    ...at,
    ...labelSize(pen, drone),
    radiusPx: drone.isUnattended ? UNATTENDED_RADIUS_PX + 5 : RADIUS_PX,
  }));
  const places = layoutLabels(wanted, RADIUS_PX, last, inTheWay);
  for (const [index, { drone, at }] of ordered.entries()) {
    const place = places.get(drone.id);
    if (!place) continue;
    if (place.isFar) {
      const { width } = wanted[index]!;
      pen.beginPath();
      pen.moveTo(at.x, at.y);
      pen.lineTo(Math.max(place.x, Math.min(at.x, place.x + width)), place.y);
      pen.strokeStyle = theme.gridText;
      pen.lineWidth = 1;
      pen.stroke();
    }
    drawLabel(pen, theme, place.x, place.y, drone);
  }
  return new Map([...places].map(([id, { slot }]) => [id, slot]));
}
