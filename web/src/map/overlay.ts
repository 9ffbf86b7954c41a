/**
 * The canvas over the map for everything that moves: drones, tracks, home, target, grid. MapLibre redraws its whole map
 * for each change of a symbol source; this costs a third to a quarter of that.
 */

import type { Map as MapLibreMap } from 'maplibre-gl';

import type { DroneState } from '../link/flight_values';
import type { Place } from '../link/messages';
import type { NearLine } from '../link/separation';
import { CLUSTER_DISC_PX, drawCluster } from './cluster_marker';
import { CLUSTER_BELOW_ZOOM, CLUSTER_RADIUS_PX, gather, type Cluster } from './clusters';
import { drawCurtain, type TrackPlace } from './curtain';
import { drawLabels } from './drone_labels';
import { drawMarker, MARKER_RADIUS_PX } from './drone_marker';
import { drawGraticule } from './graticule';
import { drawAim, drawHome, drawTarget, HOME_RADIUS_PX, type MapTarget } from './ground_signs';
import { MapCanvas, type Sheet } from './map_canvas';
import { drawNearLines } from './near_lines';
import type { Box } from './obstacles';
import type { Point, Projection } from './projection';
import { sameScene } from './scene_change';
import { drawStems } from './stems';
import { readTheme, type MapTheme } from './theme';
import { pointsOf, thinned, wayAhead, wayBehind } from './trail';

const HIT_RADIUS_PX = MARKER_RADIUS_PX + 8;
const LABEL_MARGIN_PX = 160;
const BESIDE_DASH_PX = [7, 5];

export interface SceneDrone {
  readonly id: number;
  readonly name: string;
  readonly detail: string;
  readonly place: Place;
  /** Above home; a tilted map shows it. */
  readonly upM?: number;
  readonly headingDeg: number;
  readonly state: DroneState;
  /** With heights above home, or on the ground. */
  readonly track: readonly TrackPlace[];
  /** Of a recorded flight: how many points of the track are behind the drone; the others follow. Absent: all. */
  readonly passed?: number;
  /** Of the other flight of a replay of two: its way is dashed. */
  readonly isBeside?: boolean;
  /** In the air without a holder. */
  readonly isUnattended?: boolean;
  /** Lost in the air, a battery near its end, and the like: see link/trouble.ts. */
  readonly alarm?: 'critical' | 'warning';
  /** The last known position, not the current one. */
  readonly isStale?: boolean;
}

export interface Scene {
  readonly drones: readonly SceneDrone[];
  readonly selectedId: number | null;
  readonly home: Place | null;
  readonly target: MapTarget | null;
  /** Where it would fly, while a pilot decides. */
  readonly proposed?: MapTarget | null;
  /** Between drones that come near each other. */
  readonly near?: readonly NearLine[];
  /** Where a keyboard pick would fall: the middle of the map. */
  readonly showsAim: boolean;
  /** Distances in the user's units; a new function when the units change. */
  readonly distanceWords?: (metres: number) => string;
}

interface Drawn {
  readonly drone: SceneDrone;
  readonly at: Point;
}

const alarmOrder = ({ alarm }: SceneDrone): number => (alarm === undefined ? 0 : alarm === 'warning' ? 1 : 2);
const EMPTY: Scene = { drones: [], selectedId: null, home: null, target: null, showsAim: false };
const around = ({ x, y }: Point, radiusPx: number): Box => ({
  left: x - radiusPx,
  right: x + radiusPx,
  top: y - radiusPx,
  bottom: y + radiusPx,
});
const METRES = (metres: number): string => (metres >= 1000 ? `${metres / 1000} km` : `${metres} m`);

export class Overlay {
  readonly #map: MapLibreMap;
  readonly #canvas: MapCanvas;
  #theme: MapTheme = readTheme();
  #scene: Scene = EMPTY;
  #clusters: readonly Cluster<Drawn>[] = [];
  #labelSlots: ReadonlyMap<number, number> = new Map();

  constructor(map: MapLibreMap) {
    this.#map = map;
    this.#canvas = new MapCanvas(map, { paint: (sheet) => this.#draw(sheet) });
  }

  set scene(scene: Scene) {
    const isNew = !sameScene(this.#scene, scene);
    this.#scene = scene;
    if (isNew) this.#canvas.soon();
  }

  renewTheme(): void {
    this.#theme = readTheme();
  }

  /** The drones whose marker is at this point of the map, nearest first; several form a cluster. */
  dronesAt(x: number, y: number): readonly SceneDrone[] {
    let nearest: { members: readonly Drawn[]; away: number } | null = null;
    for (const { members, x: atX, y: atY } of this.#clusters) {
      const away = Math.hypot(atX - x, atY - y);
      const reach = members.length > 1 ? CLUSTER_DISC_PX + 6 : HIT_RADIUS_PX;
      if (away <= reach && away < (nearest?.away ?? Infinity)) nearest = { members, away };
    }
    return nearest?.members.map(({ drone }) => drone) ?? [];
  }

  remove(): void {
    this.#canvas.remove();
  }

  #draw({ pen, projection, zoom, widthPx: width, heightPx: height }: Sheet): void {
    const theme = this.#theme;
    drawGraticule(pen, this.#map, theme, projection);
    const { drones, selectedId, home, target, showsAim, near: nearLines = [], distanceWords = METRES } = this.#scene;
    if (home) drawHome(pen, theme, projection, home, distanceWords);

    const isNear = ({ x, y }: Point): boolean =>
      x > -LABEL_MARGIN_PX && y > -MARKER_RADIUS_PX && x < width + MARKER_RADIUS_PX && y < height + MARKER_RADIUS_PX;
    const near = drones
      .map((drone) => ({ drone, at: projection.at(drone.place, drone.upM) }))
      .filter(({ at }) => isNear(at));
    // Neither the selected drone nor one in trouble is ever hidden in a cluster.
    const isApart = ({ drone }: Drawn): boolean => drone.id === selectedId || drone.alarm !== undefined;
    const apart = zoom >= CLUSTER_BELOW_ZOOM ? near : near.filter(isApart);
    const together = zoom >= CLUSTER_BELOW_ZOOM ? [] : near.filter((one) => !isApart(one));
    this.#clusters = [
      ...gather(together, CLUSTER_RADIUS_PX),
      ...apart.map((one) => ({ members: [one], x: one.at.x, y: one.at.y })),
    ];
    const singles = this.#clusters.flatMap(({ members }) => (members.length === 1 ? members : []));

    for (const { drone } of singles) this.#drawTrack(projection, drone);
    if (projection.isTilted) drawStems(pen, theme, projection, singles);
    drawNearLines(pen, theme, projection, nearLines);
    const inTheWay: Box[] = [];
    if (home) inTheWay.push(around(projection.at(home), HOME_RADIUS_PX));
    for (const one of [target, this.#scene.proposed])
      if (one) inTheWay.push(...drawTarget(pen, theme, projection, one));
    for (const { members, x, y } of this.#clusters) {
      if (members.length === 1) continue;
      inTheWay.push(around({ x, y }, CLUSTER_DISC_PX + 2));
      drawCluster(
        pen,
        theme,
        x,
        y,
        members.map(({ drone }) => drone.state),
      );
    }
    // Those in trouble last: on top of the others.
    const inOrder = [...singles].sort((a, b) => alarmOrder(a.drone) - alarmOrder(b.drone));
    for (const { drone, at } of inOrder) {
      drawMarker(pen, theme, at.x, at.y, { ...drone, isSelected: drone.id === selectedId });
    }
    this.#labelSlots = drawLabels(pen, theme, singles, selectedId, this.#labelSlots, inTheWay);
    if (showsAim) drawAim(pen, theme, width / 2, height / 2);
  }

  #drawTrack(projection: Projection, drone: SceneDrone): void {
    const { track, passed = track.length, state, isStale, isBeside } = drone;
    const { pen } = this.#canvas;
    const hasHeights = track[0]?.upM !== undefined;
    const place: TrackPlace = hasHeights ? { ...drone.place, upM: drone.upM ?? 0 } : drone.place;
    const draw = (way: () => Iterable<TrackPlace>, colour: string, alpha: number): void => {
      if (projection.isTilted && hasHeights) drawCurtain(pen, projection, way(), colour, alpha);
      this.#drawWay(projection, way(), colour, alpha);
    };
    if (isBeside) pen.setLineDash(BESIDE_DASH_PX);
    if (passed < track.length) draw(() => wayAhead(track, passed, place), this.#theme.states.idle, 0.35);
    if (passed > 0) draw(() => wayBehind(track, passed, place), this.#theme.states[state], isStale ? 0.25 : 0.55);
    pen.setLineDash([]);
  }

  #drawWay(projection: Projection, way: Iterable<TrackPlace>, colour: string, alpha: number): void {
    const { pen } = this.#canvas;
    pen.beginPath();
    for (const { x, y } of thinned(pointsOf(projection, way))) pen.lineTo(x, y);
    pen.strokeStyle = colour;
    pen.globalAlpha = alpha;
    pen.lineWidth = 2;
    pen.lineJoin = 'round';
    pen.stroke();
    pen.globalAlpha = 1;
  }
}
