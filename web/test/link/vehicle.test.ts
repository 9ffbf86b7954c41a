import { beforeEach, describe, expect, it } from 'vitest';

import { MAV_AUTOPILOT, MAV_RESULT, type MessageFields } from '../../src/link/generated/mavlink.gen';
import type { Entry } from '../../src/link/journal';
import { decode } from '../../src/link/mavlink';
import { modeSetOf } from '../../src/link/modes';
import { splitTagged } from '../../src/link/tagged_frames';
import { Vehicle } from '../../src/link/vehicle';
import { A_DRONE, A_HOLD, AUTOPILOT, FakeClock, fromAutopilot, heartbeat, settled } from './fakes';

let clock: FakeClock;
let sent: Uint8Array[];
let journal: Entry[];
let vehicle: Vehicle;

beforeEach(() => {
  clock = new FakeClock();
  sent = [];
  journal = [];
  vehicle = new Vehicle(
    A_DRONE,
    clock,
    {
      send(message) {
        sent.push(message);
        return true;
      },
      sendFresh(message) {
        sent.push(message);
        return 'sent';
      },
    },
    (entry) => journal.push(entry),
  );
});

const hears = (frame: Uint8Array): void => vehicle.receive(frame, clock.nowMs());
const ack = (command: number, result: number = MAV_RESULT.ACCEPTED): void =>
  hears(fromAutopilot('COMMAND_ACK', { command, result }));

/** What was sent: command number, then the fields. */
function commandsSent(): { command: number; fields: MessageFields['COMMAND_LONG' | 'COMMAND_INT'] }[] {
  return sent.map((message) => {
    const [{ droneId, frame }] = splitTagged(message)! as [{ droneId: number; frame: Uint8Array }];
    expect(droneId).toBe(A_DRONE.id);
    const decoded = decode(frame)!;
    if (decoded.name !== 'COMMAND_LONG' && decoded.name !== 'COMMAND_INT') throw new Error(decoded.name);
    expect(decoded.header).toMatchObject({ sysid: 255, compid: 190 });
    return { command: decoded.fields.command, fields: decoded.fields };
  });
}

describe('addressing', () => {
  it('uses the system id that the autopilot has', async () => {
    hears(heartbeat(0, false, { sysid: 42, compid: 1 }));
    void vehicle.perform('Arm', (flying) => flying.arm());
    await settled();
    expect(commandsSent()[0]!.fields).toMatchObject({ target_system: 42, target_component: 1, param1: 1 });
  });

  it('sends nothing before the autopilot was heard', async () => {
    hears(heartbeat(0, false, { sysid: 7, compid: 191 }));
    const outcome = await vehicle.perform('Arm', (flying) => flying.arm());
    expect(outcome.kind).toBe('failed');
    expect(sent).toEqual([]);
  });

  it('counts its frames', async () => {
    hears(heartbeat(0));
    void vehicle.flying.arm();
    await clock.pass(3_000);
    const numbers = sent.map((message) => message[4 + 4]);
    expect(numbers).toEqual([0, 1]);
    expect(commandsSent().map(({ fields }) => (fields as MessageFields['COMMAND_LONG']).confirmation)).toEqual([0, 1]);
  });
});

describe('a mode change', () => {
  it('is believed when answer and heartbeat agree', async () => {
    hears(heartbeat(0));
    const result = vehicle.perform('Return', (flying) => flying.returnHome());
    await settled();
    expect(commandsSent()[0]!.fields).toMatchObject({ command: 176, param1: 1, param2: 6 });
    ack(176);
    await settled();
    expect(vehicle.action.get()?.outcome).toBeNull();
    hears(heartbeat(6, false, { sysid: 7, compid: 154 })); // a gimbal says so: not enough
    await settled();
    expect(vehicle.action.get()?.outcome).toBeNull();
    hears(heartbeat(6));
    expect(await result).toEqual({ kind: 'accepted' });
  });

  it('is not believed on the answer alone', async () => {
    hears(heartbeat(0));
    const result = vehicle.perform('Hold', (flying) => flying.hold());
    await settled();
    ack(176);
    await settled();
    await clock.pass(1_000);
    hears(heartbeat(0));
    await clock.pass(2_000);
    expect(await result).toMatchObject({ kind: 'unconfirmed' });
    expect(vehicle.action.get()?.text).toContain('Heron accepted it, but its heartbeat does not show BRAKE');
  });

  it('to hold is one that needs nobody at the sticks', () => {
    for (const autopilot of [MAV_AUTOPILOT.ARDUPILOTMEGA, MAV_AUTOPILOT.PX4]) {
      expect(modeSetOf(autopilot)?.hold.obeysSticks).toBe(false);
    }
  });

  it('uses the numbers of PX4 where PX4 flies', async () => {
    hears(fromAutopilot('HEARTBEAT', { autopilot: 12, type: 2, custom_mode: 0, base_mode: 81 }));
    const result = vehicle.flying.land();
    await settled();
    expect(commandsSent()[0]!.fields).toMatchObject({ param1: 1, param2: 4, param3: 6 });
    ack(176);
    await settled();
    hears(fromAutopilot('HEARTBEAT', { autopilot: 12, type: 2, custom_mode: (4 << 16) | (6 << 24), base_mode: 81 }));
    expect(await result).toEqual({ kind: 'accepted' });
  });
});

describe('take-off', () => {
  it('goes to guided mode, arms, and climbs', async () => {
    hears(heartbeat(2));
    const result = vehicle.flying.takeOff(10);
    await settled();
    ack(176);
    await settled();
    hears(heartbeat(4));
    await settled();
    ack(400);
    await settled();
    ack(22);
    expect(await result).toEqual({ kind: 'accepted' });
    expect(commandsSent().map(({ command }) => command)).toEqual([176, 400, 22]);
    expect(commandsSent()[2]!.fields).toMatchObject({ param7: 10 });
  });

  it('does not arm what is armed', async () => {
    hears(heartbeat(4, true));
    void vehicle.flying.takeOff(10);
    await settled();
    ack(176);
    await settled();
    expect(commandsSent().map(({ command }) => command)).toEqual([176, 22]);
  });

  it('ends where a newer command begins: hold while it arms means no take-off', async () => {
    hears(heartbeat(4));
    const takeOff = vehicle.perform('Take off', (flying) => flying.takeOff(10));
    await settled();
    ack(176);
    await settled();
    const hold = vehicle.perform('Hold', (flying) => flying.hold());
    await settled();
    ack(400);
    expect((await takeOff).kind).toBe('failed');
    ack(176);
    await settled();
    hears(heartbeat(17, true));
    expect(await hold).toEqual({ kind: 'accepted' });
    expect(commandsSent().map(({ command }) => command)).toEqual([176, 400, 176]);
    expect(vehicle.action.get()?.label).toBe('Hold');
  });

  it('does not make hold wait for the answer to its mode change', async () => {
    hears(heartbeat(2));
    const takeOff = vehicle.flying.takeOff(10);
    await settled();
    const hold = vehicle.flying.hold();
    expect((await takeOff).kind).toBe('failed');
    ack(176);
    await settled();
    hears(heartbeat(17));
    expect(await hold).toEqual({ kind: 'accepted' });
    expect(commandsSent().map(({ fields }) => (fields as MessageFields['COMMAND_LONG']).param2)).toEqual([4, 17]);
  });

  it('ends where it is refused, and the reason is in the journal', async () => {
    hears(heartbeat(4));
    const result = vehicle.perform('Take off', (flying) => flying.takeOff(10));
    await settled();
    ack(176);
    await settled();
    hears(fromAutopilot('STATUSTEXT', { severity: 2, text: 'PreArm: GPS not healthy' }));
    ack(400, MAV_RESULT.FAILED);
    expect(await result).toEqual({ kind: 'refused', result: MAV_RESULT.FAILED });
    expect(commandsSent().map(({ command }) => command)).toEqual([176, 400]);
    expect(journal.map(({ source, severity }) => [source, severity])).toEqual([
      ['autopilot', 'error'],
      ['command', 'error'],
    ]);
  });
});

describe('go-to', () => {
  const target = { latDeg: 47.1, lonDeg: 8.2, altRelM: 20 };

  async function flyThere(): Promise<void> {
    hears(heartbeat(4, true));
    const result = vehicle.flying.goTo(target);
    await settled();
    ack(192);
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
    expect(vehicle.flying.target.get()).toBeNull();
  });

  it('that was refused leaves no target', async () => {
    hears(heartbeat(4, true));
    const result = vehicle.flying.goTo(target);
    await settled();
    ack(192, MAV_RESULT.DENIED);
    await result;
    expect(vehicle.flying.target.get()).toBeNull();
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
    const tells = (armed: boolean | null): void => vehicle.drone.set({ ...A_DRONE, armed });
    const now = () => vehicle.values(clock.nowMs());
    hears(heartbeat(4, true));
    hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }));
    tells(null);
    await clock.pass(3_000);
    expect(now()).toMatchObject({ armed: true, airborne: true, state: 'flying' });
    await clock.pass(1);
    expect(now()).toMatchObject({ armed: null, airborne: null, state: 'lost' });
    tells(true); // heartbeats were lost on the way to this page alone
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
    const told = (msAgo: number): string => new Date(clock.nowMs() - msAgo).toISOString();
    const flies = (): void => {
      hears(heartbeat(4, true));
      hears(fromAutopilot('EXTENDED_SYS_STATE', { landed_state: 2 }));
    };
    vehicle.put({ ...A_DRONE, airborne: true, airborne_since: told(60_000) }, clock.nowMs());
    expect(vehicle.values(clock.nowMs()).airborneMs).toBeNull(); // its autopilot has not said that it flies
    flies();
    expect(vehicle.values(clock.nowMs()).airborneMs).toBe(60_000);
    // A tower whose clock is ten seconds behind ours.
    vehicle.put({ ...A_DRONE, airborne: true, airborne_since: told(70_000) }, clock.nowMs(), 10_000);
    expect(vehicle.values(clock.nowMs()).airborneMs).toBe(60_000);
    // One that does not know, or is wrong about the future, cannot make it shorter than what we saw.
    await clock.pass(4_000);
    flies();
    for (const airborne_since of [null, told(-60_000), 'nonsense']) {
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

describe('texts of the autopilot', () => {
  const says = (text: string, id = 0, chunk_seq = 0, from = AUTOPILOT): void =>
    hears(fromAutopilot('STATUSTEXT', { severity: 4, text, id, chunk_seq }, from));
  /** As the journal shows them: the last with a key wins. */
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
