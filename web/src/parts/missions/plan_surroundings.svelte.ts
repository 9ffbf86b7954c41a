/** Gives a plan what is around it: the ground, once it is known whether this tower has elevation, and the zones. */

import { theGround } from '../../terrain/the_ground';
import type { PlanWorkspace } from './plan_workspace.svelte';
import { heedZones, type ZoneSources } from './plan_zones.svelte';

/** Call while a component is being made. */
export function lookAround(workspace: PlanWorkspace, sources: ZoneSources): void {
  const land = theGround();
  $effect(() => {
    workspace.ground = land.isThere ? land.at : null;
  });
  heedZones(workspace, sources);
}
