/** Merges drones that overlap at low zoom into one symbol with a number. Pure. */

import type { Point } from './projection';

/** From this zoom level on, every drone is drawn, however close together they are. */
export const CLUSTER_BELOW_ZOOM = 14;
export const CLUSTER_RADIUS_PX = 36;

export interface Cluster<T> extends Point {
  readonly members: readonly T[];
}

/** In the given order: the first drone anchors its cluster, so that clusters stay in place while people pan. */
export function gather<T extends { readonly at: Point }>(drones: readonly T[], radiusPx: number): Cluster<T>[] {
  const groups: { seed: Point; members: T[] }[] = [];
  for (const drone of drones) {
    const near = groups.find(({ seed }) => Math.hypot(seed.x - drone.at.x, seed.y - drone.at.y) < radiusPx);
    if (near) near.members.push(drone);
    else groups.push({ seed: drone.at, members: [drone] });
  }
  return groups.map(({ members }) => ({
    members,
    x: members.reduce((sum, { at }) => sum + at.x, 0) / members.length,
    y: members.reduce((sum, { at }) => sum + at.y, 0) / members.length,
  }));
}
