/** A drone as it is only known from a recording: what draws a vehicle needs one. Nothing here can be commanded. */

import { readDrone } from '../link/drone_view';
import type { Drone } from '../link/wire_types';

export const recordedDrone = (id: number, name: string): Drone =>
  readDrone({
    id,
    name,
    online: true,
    autopilot_heard: true,
    epoch: 0,
    owners: [],
    holder: null,
    taken_from: null,
    rtt_limit_ms: 0,
    offered: false,
  } as unknown as Parameters<typeof readDrone>[0]);
