import { beforeEach, describe, expect, it, vi } from 'vitest';

import type { DroneCommand } from '../src/link/drone_commands';
import { MAV_TYPE } from '../src/link/generated/mavlink.gen';
import type { Message } from '../src/link/mavlink';
import { heardIn, NOTHING_HEARD, setUpOf } from '../src/link/payload';
import { Vehicle } from '../src/link/vehicle';
import { PayloadActions } from '../src/payload_actions';
import { A_DRONE, FakeClock } from './link/fakes';

const asked = vi.hoisted(() => ({ questions: [] as { title: string; text: string }[], answer: true }));
vi.mock('../src/confirmation.svelte', () => ({
  ask: (question: { title: string; text: string }) => {
    asked.questions.push(question);
    return Promise.resolve(asked.answer);
  },
}));

const beat = (compid: number, type: number): Message =>
  ({ name: 'HEARTBEAT', header: { sysid: 1, compid }, fields: { type } }) as unknown as Message;

describe('what a drone carries', () => {
  it('is heard by heartbeats of its components, once each', () => {
    const one = heardIn(beat(101, MAV_TYPE.CAMERA), NOTHING_HEARD);
    const two = heardIn(beat(100, MAV_TYPE.CAMERA), one);
    expect(two).toEqual({ hasGimbal: false, cameras: [1, 2] });
    expect(heardIn(beat(100, MAV_TYPE.CAMERA), two)).toBe(two);
    expect(heardIn(beat(154, MAV_TYPE.GIMBAL), two).hasGimbal).toBe(true);
  });

  it('is not a quadrotor, and not a camera with a foreign number', () => {
    expect(heardIn(beat(1, MAV_TYPE.QUADROTOR), NOTHING_HEARD)).toBe(NOTHING_HEARD);
    expect(heardIn(beat(1, MAV_TYPE.CAMERA), NOTHING_HEARD)).toBe(NOTHING_HEARD);
  });

  it.each([
    [[{ name: 'GRIP_ENABLE', value: 0 }], { hasGripper: false, servos: [] }],
    [[{ name: 'GRIP_ENABLE', value: 1 }], { hasGripper: true, servos: [] }],
    [[{ name: 'PD_GRIPPER_EN', value: 1 }], { hasGripper: true, servos: [] }],
    [
      [
        { name: 'SERVO1_FUNCTION', value: 33 },
        { name: 'SERVO10_FUNCTION', value: 1 },
        { name: 'SERVO9_FUNCTION', value: 56 },
      ],
      { hasGripper: false, servos: [9, 10] },
    ],
    [
      [
        { name: 'PWM_AUX_FUNC1', value: 302 },
        { name: 'PWM_MAIN_FUNC1', value: 101 },
      ],
      { hasGripper: false, servos: [2] },
    ],
  ])('is set up by parameters: %j', (rows, expected) => {
    expect(setUpOf(rows)).toEqual(expected);
  });
});

describe('each button asks the tower for one command', () => {
  let commands: DroneCommand[];
  let actions: PayloadActions;
  beforeEach(() => {
    commands = [];
    asked.questions = [];
    asked.answer = true;
    const uplink = {
      command: (_: number, command: DroneCommand) => {
        commands.push(command);
        return Promise.resolve({ kind: 'reported', isDone: true, words: 'Done.' } as const);
      },
      send: () => true,
      sendFresh: () => 'sent' as const,
      alerts: () => [],
    };
    actions = new PayloadActions(new Vehicle(A_DRONE, new FakeClock(), uplink, () => undefined));
  });

  it.each<[string, () => Promise<void>, DroneCommand]>([
    ['point', () => actions.point(-90, 30), { command: 'gimbal', pitch_deg: -90, yaw_deg: 30 } as DroneCommand],
    ['zoom', () => actions.zoom(2, 'in'), { command: 'zoom', direction: 'in', camera: 2 } as DroneCommand],
    ['photo', () => actions.photo(1), { command: 'photo', camera: 1 } as DroneCommand],
    ['record', () => actions.record(1, true), { command: 'record', on: true, camera: 1 } as DroneCommand],
    ['grab', () => actions.grab(), { command: 'gripper', action: 'grab' } as DroneCommand],
  ])('%s, without a question', async (_, press, command) => {
    await press();
    expect(commands).toEqual([command]);
    expect(asked.questions).toEqual([]);
  });

  it.each<[string, () => Promise<void>, DroneCommand]>([
    ['release', () => actions.release(true), { command: 'gripper', action: 'release' } as DroneCommand],
    ['servo', () => actions.servo(9, 1100), { command: 'servo', servo: 9, pulse_us: 1100 }],
  ])('%s, after a question that names the drone', async (_, press, command) => {
    asked.answer = false;
    await press();
    expect(commands).toEqual([]);
    asked.answer = true;
    await press();
    expect(commands).toEqual([command]);
    for (const { title, text } of asked.questions) {
      expect(title).toContain(A_DRONE.name);
      expect(text).toContain(A_DRONE.name);
    }
  });

  it('says that a load in the air falls', async () => {
    await actions.release(true);
    await actions.release(false);
    expect(asked.questions[0]?.text).toContain('falls to the ground');
    expect(asked.questions[1]?.text).not.toContain('falls');
  });
});
