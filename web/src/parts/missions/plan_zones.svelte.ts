/** Keeps the checks of a plan told of the zones on its way, as the tower judges them for its drone. */

import { fromStore } from 'svelte/store';

import { t } from '../../languages/text';
import { LatestQuestion } from '../../link/latest_question';
import { MissionRest } from '../../link/mission_rest';
import type { Drone } from '../../link/wire_types';
import type { FlightValues } from '../../link/flight_values';
import { itemFaults, rallyFaults } from '../../plan/field_checks';
import type { Finding } from '../../plan/plan_checks';
import { MAX_ITEMS, type Plan } from '../../plan/plan_types';
import { itemsOf, rowOf } from '../../plan/wire_items';
import { zoneFindings } from '../../plan/zone_findings';
import { beat, tower } from '../../tower.svelte';
import type { PlanWorkspace } from './plan_workspace.svelte';

export interface ZoneSources {
  readonly drone: () => Drone | null;
  readonly values: () => FlightValues | null;
}

interface Question {
  readonly droneId: number;
  readonly plan: Plan;
}

/** Fences are no way of a drone. */
const KINDS = ['mission', 'rally'] as const;

/** The tower would not read it: the other checks say why. */
const isFaulty = ({ items, rally }: Plan): boolean =>
  items.length > MAX_ITEMS ||
  rally.length > MAX_ITEMS ||
  items.some((item) => itemFaults(item, items.length).length > 0) ||
  rally.some((point) => rallyFaults(point).length > 0);

/** Call while a component is being made. */
export function heedZones(workspace: PlanWorkspace, { drone, values }: ZoneSources): void {
  const rest = new MissionRest(tower.rest, tower.operations);
  const zones = fromStore(tower.around.zones.list);
  const counts = $derived(zones.current.some(({ valid_until: end }) => !end || Date.parse(end) > beat.nowMs));
  /** Null: the tower knows too little of the drone to judge. */
  const droneId = $derived.by(() => {
    const [one, heard] = [drone(), values()];
    return one?.may_watch && heard && heard.autopilot !== null ? one.id : null;
  });
  /** In the air, its way begins where it is. */
  const isFlying = $derived(values()?.airborne ?? null);

  async function ask({ droneId: id, plan }: Question): Promise<Finding[]> {
    const asked = KINDS.map(async (kind) => {
      const items = itemsOf(plan, kind);
      if (items.length === 0) return [];
      return zoneFindings(plan, kind, (await rest.foresee(id, kind, items.map(rowOf))).zones);
    });
    return (await Promise.all(asked)).flat();
  }

  const latest = new LatestQuestion(tower.clock, ask, (told) => {
    if (told === null || 'problem' in told) workspace.zones = [];
    else workspace.zones = told.answer;
    if (told !== null)
      workspace.zonesUnchecked =
        'problem' in told ? t('Zones are not checked: {problem}', { problem: told.problem }) : '';
  });

  $effect(() => {
    void [zones.current, isFlying];
    const { plan } = workspace;
    const isChecked = counts && (plan.items.length > 0 || plan.rally.length > 0);
    if (isChecked && droneId !== null && !isFaulty(plan)) return latest.put({ droneId, plan });
    latest.put(null);
    if (!isChecked) workspace.zonesUnchecked = '';
    else if (droneId === null) workspace.zonesUnchecked = t('Zones are not checked until a drone is chosen and heard.');
    else workspace.zonesUnchecked = t('Zones are not checked until the items above are right.');
  });
  $effect(() => () => latest.stop());
}
