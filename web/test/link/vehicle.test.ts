import { beforeEach, describe, expect, it } from 'vitest';

import type { Alert } from '../../src/link/alerts';
import type { DroneCommand } from '../../src/link/drone_commands';
import type { Entry } from '../../src/link/journal';
import type { Outcome } from '../../src/link/outcome';
import { lostBrief } from '../../src/link/loss_countdown';
import { Vehicle } from '../../src/link/vehicle';
import type { Drone, LastHeardView } from '../../src/link/wire_types';
import { A_DRONE, A_HOLD, anAlert, AUTOPILOT, FakeClock, fromAutopilot, heartbeat, settled } from './fakes';

let clock: FakeClock;
let commanded: [number, DroneCommand][];
let end: (outcome: Outcome) => void;
let journal: Entry[];
let vehicle: Vehicle;
let alerts: Alert[];

beforeEach(() => {
  clock = new FakeClock();
  commanded = [];
  journal = [];
  alerts = [];
  vehicle = new Vehicle(
    A_DRONE,
    clock,
    {
      command(droneId, command) {
        commanded.push([droneId, command]);
        return new Promise((resolve) => (end = resolve));
      },
      send: () => true,
      sendFresh: () => 'sent',
      alerts: (droneId) => alerts.filter((one) => one.drone_id === droneId),
    },
    (entry) => journal.push(entry),
  );
});

const hears = (frame: Uint8Array): void => vehicle.receive(frame, clock.nowMs());

describe('a command', () => {
  it('is the current action until it ends, and then in the journal', async () => {
    const result = vehicle.command('Land', { command: 'land' });
    await settled();
    expect(commanded).toEqual([[A_DRONE.id, { command: 'land' }]]);
    expect(vehicle.action.get()).toMatchObject({ label: 'Land', outcome: null });
    end({ kind: 'reported', isDone: false, words: 'Heron, changing to LAND: denied.' });
    await result;
    expect(vehicle.action.get()).toMatchObject({ text: 'Land: Heron, changing to LAND: denied.' });
    expect(journal.map(({ source, severity }) => [source, severity])).toEqual([['command', 'error']]);
  });

  it('that is older does not take the place of a newer one', async () => {
    hears(heartbeat(4));
    const land = vehicle.command('Land', { command: 'land' });
    await settled();
    void vehicle.sendHold();
    end({ kind: 'reported', isDone: true, words: 'Done.' });
    await land;
    expect(vehicle.action.get()).toMatchObject({ label: 'Hold', outcome: null });
  });
});

describe('go-to', () => {
  const GOTO = { command: 'goto', lat: 47.1, lon: 8.2, height_m: 20 } as const;
  const DONE: Outcome = { kind: 'reported', isDone: true, words: 'Done.' };

  async function flyThere(outcome = DONE): Promise<void> {
    hears(heartbeat(4, true));
    const result = vehicle.command('Go to', GOTO);
    await settled();
    end(outcome);
    await result;
  }

  it('remembers its target and tells the distance', async () => {
    await flyThere();
    hears(fromAutopilot('GLOBAL_POSITION_INT', { lat: 471000000, lon: 82000000, relative_alt: 20_000 }));
    expect(vehicle.values(clock.nowMs()).targetDistanceM).toBeCloseTo(0, 3);
  });

  it('forgets it when the mode is left, by whomever', async () => {
    await flyThere();
    hears(heartbeat(6, true));
    expect(vehicle.target.now.get()).toBeNull();
  });

  it('that was refused leaves no target', async () => {
    await flyThere({ ...DONE, isDone: false });
    expect(vehicle.target.now.get()).toBeNull();
  });

  it.each([
    ['another command', () => void vehicle.command('Land', { command: 'land' }), null],
    ['a hold', () => void vehicle.sendHold(), null],
    ['a speed', () => void vehicle.command('Speed', { command: 'speed', m_s: 3 }), 20],
  ])('that is answered after %s', async (_, meanwhile, altRelM) => {
    hears(heartbeat(4, true));
    const result = vehicle.command('Go to', GOTO);
    await settled();
    const answerIt = end;
    meanwhile();
    await settled();
    answerIt(DONE);
    await result;
    expect(vehicle.target.now.get()?.altRelM ?? null).toBe(altRelM);
  });
});

describe('the values', () => {
  it('are unknown before anything was heard', () => {
    const values = vehicle.values(clock.nowMs());
    expect(values).toMatchObject({ state: 'lost', mode: null, armed: null, altRelM: null, batteryPercent: null });
  });

  it('come from the autopilot alone', () => {
    hears(heartbeat(4, true));
    hears(heartbeat(0, false, { sysid: 7, compid: 191 }));
    hears(fromAutopilot('SYS_STATUS', { battery_remaining: 12 }, { sysid: 7, compid: 154 }));
    hears(fromAutopilot('SYS_STATUS', { battery_remaining: 80, voltage_battery: 16_100 }));
    const values = vehicle.values(clock.nowMs());
    expect(values).toMatchObject({ mode: 'GUIDED', armed: true, batteryPercent: 80, batteryV: 16.1 });
  });

  it('take speed and climb from whatever came last, where a thin stream leaves one of the two behind', async () => {
    hears(heartbeat(4));
    const moving = fromAutopilot('GLOBAL_POSITION_INT', { lat: 1, lon: 1, vx: 300, vy: 400, vz: -200 });
    hears(fromAutopilot('VFR_HUD', { groundspeed: 9, climb: 1.5 }));
    hears(moving);
    expect(vehicle.values(clock.nowMs())).toMatchObject({ groundSpeedMps: 9, climbMps: 1.5 });
    await clock.pass(5_000);
    hears(moving);
    expect(vehicle.values(clock.nowMs())).toMatchObject({ groundSpeedMps: 5, climbMps: 2 });
    hears(fromAutopilot('VFR_HUD', { groundspeed: 7, climb: 0.5 }));
    expect(vehicle.values(clock.nowMs())).toMatchObject({ groundSpeedMps: 7, climbMps: 0.5 });
  });

  it.each([
    ['idle', false, 1],
    ['armed', true, 1],
    ['flying', true, 2],
  ] as const)('say %s', (state, armed, landed) => {
    hears(heartbeat(4, armed));
    hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: landed }));
    expect(vehicle.values(clock.nowMs()).state).toBe(state);
  });

  it('say that the link is lost when heartbeats stop, or the tower says offline', async () => {
    hears(heartbeat(4));
    await clock.pass(5_000);
    expect(vehicle.values(clock.nowMs()).state).toBe('idle');
    await clock.pass(1);
    expect(vehicle.values(clock.nowMs()).state).toBe('lost');
    hears(heartbeat(4));
    vehicle.drone.set({ ...A_DRONE, online: false });
    expect(vehicle.values(clock.nowMs()).state).toBe('lost');
  });

  it('do not know whether it is armed once the autopilot is silent, unless the agent still hears it', async () => {
    const reports = (armed: boolean | null): void => vehicle.drone.set({ ...A_DRONE, armed });
    const now = () => vehicle.values(clock.nowMs());
    hears(heartbeat(4, true));
    hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }));
    reports(null);
    await clock.pass(3_000);
    expect(now()).toMatchObject({ armed: true, airborne: true, state: 'flying' });
    await clock.pass(1);
    expect(now()).toMatchObject({ armed: null, airborne: null, state: 'lost' });
    reports(true); // heartbeats were lost on the way to this page alone
    expect(now()).toMatchObject({ armed: true, airborne: true, state: 'flying' });
    await clock.pass(2_000);
    expect(now()).toMatchObject({ armed: null, airborne: null, state: 'lost', mode: 'GUIDED' });
  });

  it('do not call the motors of a drone that is offline off', () => {
    hears(heartbeat(4, false));
    vehicle.drone.set({ ...A_DRONE, online: false });
    expect(vehicle.values(clock.nowMs())).toMatchObject({ armed: null, airborne: null });
  });

  it('read the hold by the clock of the tower', () => {
    const hold = { ...A_HOLD, due_at: new Date(clock.nowMs() + 14_000).toISOString() };
    vehicle.put({ ...A_DRONE, hold }, clock.nowMs(), 10_000);
    expect(vehicle.hold(clock.nowMs())).toMatchObject({ secondsLeft: 24, canStay: true });
    vehicle.put(A_DRONE, clock.nowMs());
    expect(vehicle.hold(clock.nowMs())).toBeNull();
  });

  it('measure the time in the air', async () => {
    hears(heartbeat(4, true));
    hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }));
    await clock.pass(4_000);
    hears(heartbeat(4, true));
    expect(vehicle.values(clock.nowMs()).airborneMs).toBe(4_000);
    hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 1 }));
    expect(vehicle.values(clock.nowMs()).airborneMs).toBeNull();
  });

  it('have the time in the air from the tower where the page was opened later', async () => {
    const reported = (msAgo: number): string => new Date(clock.nowMs() - msAgo).toISOString();
    const flies = (): void => {
      hears(heartbeat(4, true));
      hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }));
    };
    vehicle.put({ ...A_DRONE, airborne: true, airborne_since: reported(60_000) }, clock.nowMs());
    expect(vehicle.values(clock.nowMs()).airborneMs).toBeNull(); // its autopilot has not reported flight
    flies();
    expect(vehicle.values(clock.nowMs()).airborneMs).toBe(60_000);
    // A tower whose clock is ten seconds behind ours.
    vehicle.put({ ...A_DRONE, airborne: true, airborne_since: reported(70_000) }, clock.nowMs(), 10_000);
    expect(vehicle.values(clock.nowMs()).airborneMs).toBe(60_000);
    // A tower without a time, or with one in the future, cannot make it shorter than what we saw.
    await clock.pass(4_000);
    flies();
    for (const airborne_since of [null, reported(-60_000), 'nonsense']) {
      vehicle.put({ ...A_DRONE, airborne: true, airborne_since }, clock.nowMs());
      expect(vehicle.values(clock.nowMs()).airborneMs).toBe(4_000);
    }
  });

  it('keep a bounded track without points that say nothing', () => {
    hears(heartbeat(4, true));
    for (let step = 0; step < 2_000; step++) {
      hears(fromAutopilot('GLOBAL_POSITION_INT', { lat: 470000000 + step * 100, lon: 80000000 }));
    }
    expect(vehicle.telemetry.track).toHaveLength(600);
    hears(fromAutopilot('GLOBAL_POSITION_INT', { lat: 0, lon: 0 }));
    expect(vehicle.telemetry.track.at(-1)!.latDeg).toBeCloseTo(47.02, 2);
  });
});

describe('a drone that fell silent before this page was opened', () => {
  const LAG_MS = 5_000;
  const opened = (last: Partial<LastHeardView> = {}, drone: Partial<Drone> = {}): void => {
    const last_heard: LastHeardView = {
      at: new Date(clock.nowMs() - LAG_MS - 12_000).toISOString(),
      armed: true,
      airborne: true,
      autopilot: 3,
      vehicle_type: 2,
      custom_mode: 3,
      lat: 47.5,
      lon: 8.25,
      height_m: 40,
      ...last,
    };
    const gone = { ...A_DRONE, online: false, autopilot_heard: false, armed: null, airborne: null };
    vehicle.put({ ...gone, last_heard, ...drone }, clock.nowMs(), LAG_MS);
  };
  const now = () => vehicle.values(clock.nowMs());

  it('is lost in the air, and does what it did', async () => {
    opened();
    const silence = vehicle.silence(null, clock.nowMs());
    expect(silence).toMatchObject({ mode: 'AUTO', task: 'mission', isAirborne: true, whose: 'drone' });
    expect(lostBrief(silence!, clock.nowMs())).toEqual({ now: 'goes on with its mission', next: 'returns in 18 s' });
    await clock.pass(8_000);
    expect(lostBrief(vehicle.silence(null, clock.nowMs())!, clock.nowMs()).next).toBe('returns in 10 s');
    expect(now()).toMatchObject({ state: 'lost', armed: null, altRelM: 40, positionAgeMs: 20_000 });
    expect(now().place).toEqual({ latDeg: 47.5, lonDeg: 8.25 });
  });

  it('is merely offline if it was on the ground', () => {
    opened({ airborne: false, armed: false });
    expect(vehicle.silence(null, clock.nowMs())).toMatchObject({ isAirborne: false });
  });

  it('has no place and no mode where the tower has none', () => {
    opened({ autopilot: null, custom_mode: null, vehicle_type: null, lat: null, lon: null, height_m: null });
    expect(now()).toMatchObject({ mode: null, place: null, altRelM: null, positionAgeMs: null });
  });

  it('is what it says itself, once it is heard', () => {
    opened();
    hears(heartbeat(5, true));
    expect(now()).toMatchObject({ mode: 'LOITER', place: null });
    vehicle.put({ ...A_DRONE, armed: true, airborne: true }, clock.nowMs());
    expect(vehicle.wasAirborne).toBe(true);
  });

  it('is what this page heard, unless the tower heard it later', async () => {
    hears(heartbeat(5, true));
    opened({ at: new Date(clock.nowMs() - LAG_MS + 3_000).toISOString() });
    expect(now().mode).toBe('LOITER');
    await clock.pass(60_000);
    opened();
    expect(now().mode).toBe('AUTO');
  });
});

it("has the trouble that the tower's alerts tell of", () => {
  expect(vehicle.trouble()).toBeNull();
  alerts = [anAlert({ drone_id: A_DRONE.id, rule: 'gps' }), anAlert({ drone_id: A_DRONE.id + 1 })];
  expect(vehicle.trouble()).toMatchObject({ kind: 'gps', severity: 'warning' });
});

describe('texts of the autopilot', () => {
  const says = (text: string, id = 0, chunk_seq = 0, from = AUTOPILOT): void =>
    hears(fromAutopilot('STATUSTEXT', { severity: 4, text, id, chunk_seq }, from));
  /** As the journal shows them: the last entry of a key wins. */
  const shown = (): string[] => [...new Map(journal.map(({ key, text }) => [key, text])).values()];

  it('come whole when they come in chunks', () => {
    const whole = 'x'.repeat(50) + 'y'.repeat(50) + ' end';
    says(whole.slice(0, 50), 3, 0);
    says('in between');
    says(whole.slice(50, 100), 3, 1);
    says(whole.slice(100), 3, 2);
    expect(shown()).toEqual([whole, 'in between']);
  });

  it('show where a chunk is missing', () => {
    says('a'.repeat(50), 4, 0);
    says('the end', 4, 2);
    expect(shown()).toEqual([`${'a'.repeat(50)} […] the end`]);
    says('b', 9, 1);
    expect(shown().at(-1)).toBe('[…] b');
  });

  it('of two components do not mix', () => {
    says('a'.repeat(50), 4, 0);
    says('other', 4, 1, { sysid: 7, compid: 191 });
    says('A', 4, 1);
    expect(shown()).toEqual([`${'a'.repeat(50)}A`, '[…] other']);
  });
});
