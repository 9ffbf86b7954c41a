/** How many items an autopilot has room for on its usual boards: as in wire/plan_room.py, which has the sources. */

import type { AutopilotKind } from './catalogue';
import type { PlanKind } from './plan_types';

export const ROOM: Readonly<Record<AutopilotKind, Readonly<Record<PlanKind, number>>>> = {
  ardupilot: { mission: 649, fence: 70, rally: 46 },
  px4: { mission: 724, fence: 64, rally: 32 },
};
