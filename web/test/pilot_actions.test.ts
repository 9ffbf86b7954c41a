import { beforeEach, describe, expect, it, vi } from 'vitest';

import type { Question } from '../src/confirmation.svelte';
import { GuidedActions } from '../src/guided_actions';
import type { DroneCommand } from '../src/link/drone_commands';
import type { FlightValues } from '../src/link/flight_values';
import type { Operations } from '../src/link/operations';
import { Vehicle } from '../src/link/vehicle';
import { MissionActions } from '../src/parts/missions/mission_actions';
import { PilotActions } from '../src/pilot_actions';
import { A_DRONE, FakeClock, fromAutopilot, heartbeat } from './link/fakes';

const asked = vi.hoisted(() => ({ acknowledged: 0, questions: [] as Question[] }));
vi.mock('../src/confirmation.svelte', () => ({
  FALLS_S: 3,
  LEAVES_OR_ENDS_S: 1,
  ask: (question: Question) => {
    asked.questions.push(question);
    return Promise.resolve(true);
  },
}));
vi.mock('../src/preferences.svelte', () => ({ preferences: { units: 'metric' } }));
vi.mock('../src/arming', () => ({
  warningsBefore: () => Promise.resolve(['Battery: 40 %']),
  confirmArming: () => Promise.resolve(() => Promise.resolve(void asked.acknowledged++)),
}));

const HERE = { latDeg: 47, lonDeg: 8 };
const THERE = { latDeg: 47.1, lonDeg: 368.2, altRelM: 20 };

let commands: DroneCommand[];
let frames: number;
let vehicle: Vehicle;
let values: Partial<FlightValues>;
let pilot: PilotActions;
let guided: GuidedActions;
let mission: MissionActions;

beforeEach(() => {
  commands = [];
  frames = 0;
  asked.acknowledged = 0;
  asked.questions = [];
  const uplink = {
    command: (_: number, command: DroneCommand) => {
      commands.push(command);
      return Promise.resolve({ kind: 'reported', isDone: true, words: 'Done.' } as const);
    },
    send: () => ++frames > 0,
    sendFresh: () => 'sent' as const,
    alerts: () => [],
  };
  const clock = new FakeClock();
  vehicle = new Vehicle(A_DRONE, clock, uplink, () => undefined);
  vehicle.receive(heartbeat(4, true), clock.nowMs());
  vehicle.receive(fromAutopilot('HOME_POSITION', { altitude: 488_500 }), clock.nowMs());
  values = { airborne: true, armed: true, autopilot: 3, mode: 'GUIDED', place: HERE, altRelM: 12 };
  const now = () => values as FlightValues;
  pilot = new PilotActions(vehicle, now);
  guided = new GuidedActions(vehicle, {} as Operations, now);
  mission = new MissionActions(vehicle, now);
});

describe('each button asks the tower for one command', () => {
  it.each<[string, () => Promise<unknown>, DroneCommand]>([
    ['arm', () => pilot.arm(), { command: 'arm' }],
    ['disarm in flight', () => pilot.disarm(), { command: 'disarm', force: true }],
    ['take off', () => pilot.takeOff(10), { command: 'takeoff', height_m: 10 }],
    ['return', () => pilot.returnHome(), { command: 'rtl' }],
    ['land', () => pilot.land(), { command: 'land' }],
    ['mode', () => pilot.changeMode('POSHOLD'), { command: 'mode', mode: 'POSHOLD' }],
    [
      'go to',
      () => pilot.goTo(THERE),
      { command: 'goto', lat: 47.1, lon: expect.closeTo(8.2) as number, height_m: 20 },
    ],
    ['height', () => pilot.changeHeight(30), { command: 'goto', lat: 47, lon: 8, height_m: 30 }],
    ['speed', () => pilot.changeSpeed(3), { command: 'speed', m_s: 3 }],
    ['turn', () => pilot.turnTo(270), { command: 'yaw', deg: 270 }],
    ['home here', () => pilot.setHome(null), { command: 'set_home', here: true, while_flying: true }],
    [
      'home on the map',
      () => pilot.setHome(HERE),
      { command: 'set_home', lat: 47, lon: 8, altitude_m: 488.5, while_flying: true } as DroneCommand,
    ],
    [
      'circle',
      () => guided.orbit({ ...HERE, altRelM: 20, radiusM: 30, isClockwise: false, speedMps: 4 }),
      { command: 'orbit', lat: 47, lon: 8, height_m: 20, radius_m: -30, m_s: 4 },
    ],
    [
      'look at',
      () => guided.lookAt({ ...HERE, altRelM: 0 }),
      { command: 'roi', lat: 47, lon: 8, height_m: 0 } as DroneCommand,
    ],
    ['look ahead', () => guided.lookAhead(), { command: 'roi', none: true }],
    ['start the mission', () => guided.startMission(2, 5), { command: 'start', item: 2 }],
    ['pause', () => guided.pauseMission(), { command: 'pause' }],
    ['resume', () => guided.resumeMission(), { command: 'resume' }],
    ['jump', () => guided.jumpTo(4, 'way-point'), { command: 'jump', item: 4 }],
    ['start, on the page of missions', () => mission.start(5), { command: 'start' } as DroneCommand],
    ['pause, there', () => mission.pause(), { command: 'pause' }],
    ['resume, there', () => mission.resume(null), { command: 'resume' }],
    ['jump, there', () => mission.jump(4, 'way-point'), { command: 'jump', item: 4 }],
    ['return, there', () => mission.returnHome(), { command: 'rtl' }],
  ])('%s', async (_, press, command) => {
    await press();
    expect(commands).toEqual([command]);
    expect(frames).toBe(0);
  });

  it('on the ground: disarms without force, moves home without a word about flying', async () => {
    values = { ...values, airborne: false };
    await pilot.disarm();
    await pilot.setHome(null);
    expect(commands).toEqual([{ command: 'disarm' }, { command: 'set_home', here: true }]);
  });

  it('says before arming that the loss check was read', async () => {
    values = { ...values, airborne: false, armed: false };
    await pilot.arm();
    await pilot.takeOff(5);
    await guided.startMission(0, 5);
    await mission.start(5);
    expect(commands.map(({ command }) => command)).toEqual(['arm', 'takeoff', 'start', 'start']);
    expect(asked.acknowledged).toBe(4);
  });

  it('but hold, which is a frame', () => {
    void pilot.hold();
    expect([commands, frames]).toEqual([[], 1]);
  });

  it('and none where something is not known', async () => {
    values = { ...values, place: null };
    await pilot.changeHeight(10);
    expect(commands).toEqual([]);
    expect(vehicle.action.get()?.text).toContain('its position is unknown');
  });
});

describe('a start in the middle', () => {
  const refuse = (problem: string): void => {
    vi.spyOn(vehicle, 'command').mockImplementation((_, command) => {
      commands.push(command);
      const isDone = 'as_it_is' in command;
      const words = 'Kestrel would fly from item 3 without what earlier items set: servo 9 at 1900 µs.';
      return Promise.resolve({ kind: 'reported', isDone, words, ...(isDone ? {} : { problem }) });
    });
  };

  it.each<[string, () => Promise<unknown>, object]>([
    ['start', () => guided.startMission(2, 5), { command: 'start', item: 2 }],
    ['jump', () => guided.jumpTo(2, 'a way point'), { command: 'jump', item: 2 }],
  ])('asks whether to %s without what nobody sets again', async (_, act, command) => {
    refuse('state-not-restored');
    await act();
    expect(commands).toEqual([command, { ...command, as_it_is: true }]);
    expect(asked.questions.at(-1)?.title).toContain(A_DRONE.name);
    expect(asked.questions.at(-1)?.text).toContain('servo 9 at 1900 µs');
  });

  it('asks nothing more where it is refused for another reason', async () => {
    refuse('not-in-control');
    await guided.startMission(2, 5);
    expect(commands).toEqual([{ command: 'start', item: 2 }]);
  });
});

describe('what is asked before (docs/console.md, "Confirmation")', () => {
  const questions = async (act: () => Promise<unknown>): Promise<Question[]> => {
    await act();
    return asked.questions;
  };

  it.each<[string, () => Promise<unknown>]>([
    ['height', () => pilot.changeHeight(30)],
    ['speed', () => pilot.changeSpeed(3)],
    ['turn', () => pilot.turnTo(270)],
    ['pause', () => mission.pause()],
  ])('nothing, where Hold ends it: %s', async (_, act) => {
    expect(await questions(act)).toEqual([]);
  });

  it.each<[string, () => Promise<unknown>]>([
    ['return', () => pilot.returnHome()],
    ['land', () => pilot.land()],
  ])('a button to hold for a second, where it ends a flight: %s', async (_, act) => {
    expect(await questions(act)).toMatchObject([{ heldS: 1, title: expect.stringContaining('Heron') as string }]);
  });

  it('the same with what is open, where it leaves the ground', async () => {
    values = { ...values, airborne: false };
    expect(await questions(() => mission.start(3))).toMatchObject([{ heldS: 1, warnings: ['Battery: 40 %'] }]);
  });

  it('one longer, which names the drone and says what falls', async () => {
    expect(await questions(() => pilot.disarm())).toMatchObject([
      {
        heldS: 3,
        isDanger: true,
        title: 'Stop the motors of Heron in flight?',
        text: 'Heron falls to the ground from 12 m, and nothing can stop it then.',
        confirmLabel: 'Let Heron fall',
      },
    ]);
  });

  it('a press, where the drone stands', async () => {
    values = { ...values, airborne: false };
    const [question] = await questions(() => pilot.disarm());
    expect(question).not.toHaveProperty('heldS');
  });

  it('says beside a number what Enter will do', () => {
    expect(pilot.heightPreview(30)).toBe('Enter: Heron climbs from 12 m to 30 m above home');
    expect(pilot.heightPreview(5)).toBe('Enter: Heron descends from 12 m to 5 m above home');
    values = { ...values, altRelM: null };
    expect(pilot.heightPreview(5)).toBe('Enter: Heron goes to 5 m above home');
    expect(pilot.speedPreview(3)).toBe('Enter: Heron flies at 3 m/s over the ground');
    expect(pilot.headingPreview(90)).toBe('Enter: Heron turns to 90° where it is');
  });
});
