import { beforeEach, expect, it } from 'vitest';

import { MAV_AUTOPILOT } from '../../src/link/generated/mavlink.gen';
import { decode } from '../../src/link/mavlink';
import { MissionProgress } from '../../src/link/mission_progress';
import { fromAutopilot } from './fakes';

const current = (seq: number) => decode(fromAutopilot('MISSION_CURRENT', { seq, total: 9 }))!;
const reached = (seq: number) => decode(fromAutopilot('MISSION_ITEM_REACHED', { seq }))!;

let mission: MissionProgress;
beforeEach(() => {
  mission = new MissionProgress();
});

it("counts a plan's items: ArduPilot's number 0 is home, PX4 has no such thing", () => {
  mission.receive(current(3), MAV_AUTOPILOT.ARDUPILOTMEGA);
  expect(mission.now.get().current).toBe(2);
  mission.receive(current(0), MAV_AUTOPILOT.ARDUPILOTMEGA);
  expect(mission.now.get().current).toBeNull();
  mission.receive(current(3), MAV_AUTOPILOT.PX4);
  expect(mission.now.get().current).toBe(3);
});

it('says nothing while nobody knows which autopilot counts', () => {
  mission.receive(current(3), null);
  expect(mission.now.get().current).toBeNull();
});

it('remembers what was reached until there is another mission or another beginning', () => {
  mission.onBoard('aaaaaaaaaaaaaaaa');
  mission.receive(reached(1), MAV_AUTOPILOT.ARDUPILOTMEGA);
  mission.receive(reached(2), MAV_AUTOPILOT.ARDUPILOTMEGA);
  mission.onBoard('aaaaaaaaaaaaaaaa');
  expect([...mission.now.get().reached]).toEqual([0, 1]);
  mission.receive(current(4), MAV_AUTOPILOT.ARDUPILOTMEGA);
  mission.begun();
  expect(mission.now.get()).toEqual({ current: 3, reached: new Set() });
  mission.receive(reached(4), MAV_AUTOPILOT.ARDUPILOTMEGA);
  mission.onBoard('bbbbbbbbbbbbbbbb');
  expect(mission.now.get()).toEqual({ current: null, reached: new Set() });
});

it('is the same value while nothing changes: who shows it draws nothing again', () => {
  mission.receive(current(3), MAV_AUTOPILOT.ARDUPILOTMEGA);
  const before = mission.now.get();
  mission.receive(current(3), MAV_AUTOPILOT.ARDUPILOTMEGA);
  expect(mission.now.get()).toBe(before);
});
