/** Gives a plan the home of the drone that it is for (plan/planned_home.ts). */

import { untrack } from 'svelte';

import type { FlightValues } from '../../link/flight_values';
import type { Vehicle } from '../../link/vehicle';
import { beginAt, beginsElsewhere } from '../../plan/planned_home';
import { spotOf } from '../../plan/plan_types';
import { beat } from '../../tower.svelte';
import type { PlanWorkspace } from './plan_workspace.svelte';

interface Sources {
  readonly vehicle: () => Vehicle | undefined;
  readonly values: () => FlightValues | null;
  readonly squad: () => readonly Vehicle[];
}

/**
 * For the page, while it exists: a plan without a home, or with that of the drone chosen before, takes the drone's home;
 * once for each drone, so that the user can undo it.
 */
export function followHome(workspace: PlanWorkspace, { vehicle, values, squad }: Sources): void {
  let takenFor = '';

  const isForAnother = $derived.by(() => {
    const home = values()?.home;
    if (!home) return false;
    const others = squad().flatMap((one) => {
      const theirs = one === vehicle() ? null : one.values(beat.nowMs).home;
      return theirs ? [spotOf(theirs.latDeg, theirs.lonDeg)] : [];
    });
    return beginsElsewhere(workspace.plan.home, spotOf(home.latDeg, home.lonDeg), others);
  });

  function take(): void {
    const [drone, home] = [vehicle(), values()?.home];
    if (!home || !drone) return;
    const altM = (drone.telemetry.newest('HOME_POSITION')?.fields.altitude ?? 0) / 1000;
    const isFresh = workspace.isEmpty && !workspace.isUnsaved;
    const spot = spotOf(home.latDeg, home.lonDeg);
    if (isFresh) workspace.beginWith({ ...workspace.plan, home: { spot, altM } });
    else workspace.apply(beginAt({ spot, altM }));
  }

  $effect(() => {
    const plan = `${workspace.shows} ${vehicle()?.drone.get().id}`;
    if (!isForAnother || takenFor === plan) return;
    takenFor = plan;
    untrack(take);
  });
}
