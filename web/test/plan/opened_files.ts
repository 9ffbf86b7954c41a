/** Opens plan files as the console does, and returns the result as rows. */

import { openPlanFile } from '../../src/plan/formats/open_plan_file';
import type { ReadFile } from '../../src/plan/formats/plan_file';
import type { Plan, PlanKind } from '../../src/plan/plan_types';
import { itemsOf, rowOf } from '../../src/plan/wire_items';

const DEFAULTS = { heightM: 60, frame: 3, speedMS: 4 };
const noXml = (): Document => {
  throw new Error('no file here is XML');
};
export const open = (text: string, fileName = ''): ReadFile =>
  openPlanFile(text, { defaults: DEFAULTS, fileName }, noXml);
export const rows = (plan: Plan, kind: PlanKind): unknown[] => itemsOf(plan, kind).map(rowOf);
export const KINDS: readonly PlanKind[] = ['mission', 'fence', 'rally'];
export const TAKEOFF = [22, 3, [15, 0, 0, 0], 473_977_000, 85_456_000, 25, 1];
export const WAYPOINT = [16, 3, [2, 0, 0, 0], 473_982_000, 85_441_000, 40, 1];
export const JUMP_TO_SECOND = [177, 2, [1, 3, 0, 0], 0, 0, 0, 1];
