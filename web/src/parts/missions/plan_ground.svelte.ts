/** Gives a plan the ground under it, once it is known whether this tower has elevation. */

import { theGround } from '../../terrain/the_ground';
import type { PlanWorkspace } from './plan_workspace.svelte';

/** Call while a component is being made. */
export function lieOnGround(workspace: PlanWorkspace): void {
  const land = theGround();
  $effect(() => {
    workspace.ground = land.isThere ? land.at : null;
  });
}
