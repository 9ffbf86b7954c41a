import { beforeEach, describe, expect, it } from 'vitest';

import { MAV_AUTOPILOT, MAV_RESULT, MAV_TYPE, type MessageFields } from '../../src/link/generated/mavlink.gen';
import { decode } from '../../src/link/mavlink';
import { modeSetOf } from '../../src/link/modes';
import type { Outcome } from '../../src/link/outcome';
import { splitTagged } from '../../src/link/tagged_frames';
import { Vehicle } from '../../src/link/vehicle';
import { A_DRONE, FakeClock, fromAutopilot, heartbeat, settled } from './fakes';

const BRAKE = 17;

let clock: FakeClock;
let sent: Uint8Array[];
let isConnected: boolean;
let vehicle: Vehicle;

beforeEach(() => {
  clock = new FakeClock();
  sent = [];
  isConnected = true;
  const uplink = {
    command: () => Promise.reject(new Error('a hold asks for nothing')),
    send(message: Uint8Array): boolean {
      if (isConnected) sent.push(message);
      return isConnected;
    },
    sendFresh: () => 'sent' as const,
    alerts: () => [],
  };
  vehicle = new Vehicle(A_DRONE, clock, uplink, () => undefined);
});

const hears = (frame: Uint8Array): void => vehicle.receive(frame, clock.nowMs());
const ack = (result: number = MAV_RESULT.ACCEPTED, target_system = 255): void =>
  hears(fromAutopilot('COMMAND_ACK', { command: 176, result, target_system }));

function commandsSent(): MessageFields['COMMAND_LONG'][] {
  return sent.map((message) => {
    const { droneId, frame } = splitTagged(message)![0]!;
    expect(droneId).toBe(A_DRONE.id);
    const decoded = decode(frame)!;
    if (decoded.name !== 'COMMAND_LONG') throw new Error(decoded.name);
    expect(decoded.header).toMatchObject({ sysid: 255, compid: 190 });
    return decoded.fields;
  });
}

function watch(promise: Promise<Outcome>): { outcome: Outcome | null } {
  const seen: { outcome: Outcome | null } = { outcome: null };
  void promise.then((outcome) => (seen.outcome = outcome));
  return seen;
}

describe('a hold', () => {
  it('is sent at once, to the system id that the autopilot has', () => {
    hears(heartbeat(4, true, { sysid: 42, compid: 1 }));
    void vehicle.sendHold();
    const target = { target_system: 42, target_component: 1 };
    expect(commandsSent()).toMatchObject([{ command: 176, param1: 1, param2: BRAKE, confirmation: 0, ...target }]);
  });

  it('is sent to nobody before the autopilot was heard', async () => {
    hears(heartbeat(0, false, { sysid: 7, compid: 191 }));
    expect((await vehicle.sendHold()).kind).toBe('failed');
    expect(sent).toEqual([]);
  });

  it('is sent in the mode that the kind of vehicle has, and to a rover not at all', async () => {
    const { FIXED_WING, GROUND_ROVER } = MAV_TYPE;
    const beats = (type: number): Uint8Array =>
      fromAutopilot('HEARTBEAT', { type, autopilot: MAV_AUTOPILOT.ARDUPILOTMEGA, base_mode: 0x81 });
    hears(beats(FIXED_WING));
    void vehicle.sendHold();
    expect(commandsSent()).toMatchObject([{ command: 176, param1: 1, param2: 12 }]);
    sent = [];
    hears(beats(GROUND_ROVER));
    expect((await vehicle.sendHold()).kind).toBe('failed');
    expect(sent).toEqual([]);
  });

  it('is not kept without a connection', async () => {
    hears(heartbeat(4));
    isConnected = false;
    expect((await vehicle.sendHold()).kind).toBe('failed');
    isConnected = true;
    await clock.pass(30_000);
    expect(sent).toEqual([]);
  });

  it('is believed when answer and heartbeat agree', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    hears(heartbeat(BRAKE, true)); // another sender's command: ours is still unanswered
    ack();
    hears(heartbeat(4, true));
    hears(heartbeat(BRAKE, false, { sysid: 7, compid: 154 })); // from a gimbal: not enough
    await settled();
    expect(seen.outcome).toEqual({ kind: 'accepted' }); // the newest heartbeat showed it when the answer came
    expect(clock.waiting).toBe(0);
  });

  it('is not believed on the answer alone', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    ack();
    await clock.pass(2_999);
    expect(seen.outcome).toBeNull();
    await clock.pass(1);
    expect(seen.outcome).toMatchObject({ kind: 'unconfirmed', detail: 'its heartbeat does not show BRAKE' });
  });

  it('waits for its own answer: the agent changes modes too', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    ack(MAV_RESULT.FAILED, 1);
    await settled();
    expect(seen.outcome).toBeNull();
    ack(MAV_RESULT.FAILED);
    await settled();
    expect(seen.outcome).toEqual({ kind: 'refused', result: MAV_RESULT.FAILED });
  });

  it('is repeated once, with the repeat counted, then given up', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    await clock.pass(3_000);
    expect(commandsSent().map(({ confirmation }) => confirmation)).toEqual([0, 1]);
    await clock.pass(3_000);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
    expect(sent).toHaveLength(2);
  });

  it('is reached when the heartbeat shows it, though its answer is lost', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    hears(heartbeat(BRAKE));
    await clock.pass(2_999);
    expect(seen.outcome).toBeNull(); // its refusal may still come
    await clock.pass(1);
    expect(seen.outcome).toEqual({ kind: 'accepted' });
    expect(sent).toHaveLength(1);
  });

  it('is not reached by the hold of a failsafe', async () => {
    const beat = (custom_mode: number, system_status: number): Uint8Array =>
      fromAutopilot('HEARTBEAT', { autopilot: 12, type: 2, custom_mode, base_mode: 0x81, system_status });
    hears(beat(3 << 16, 4));
    const seen = watch(vehicle.sendHold());
    hears(beat((4 << 16) | (3 << 24), 5));
    await clock.pass(6_000);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
  });

  it('in progress has longer each time', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    for (let report = 0; report < 5; report += 1) {
      ack(MAV_RESULT.IN_PROGRESS);
      await clock.pass(15_000);
    }
    expect(seen.outcome).toBeNull();
  });

  it('in progress may take longer, and is not repeated', async () => {
    hears(heartbeat(4));
    const seen = watch(vehicle.sendHold());
    ack(MAV_RESULT.IN_PROGRESS);
    await clock.pass(19_999);
    expect(seen.outcome).toBeNull();
    await clock.pass(1);
    expect(seen.outcome).toEqual({ kind: 'no-answer' });
    expect(sent).toHaveLength(1);
  });

  it('that is newer takes the place of an older one', async () => {
    hears(heartbeat(4));
    const older = watch(vehicle.sendHold());
    const newer = watch(vehicle.sendHold());
    ack();
    hears(heartbeat(BRAKE));
    await settled();
    expect([older.outcome?.kind, newer.outcome?.kind]).toEqual(['failed', 'accepted']);
    expect(sent).toHaveLength(2);
  });

  it('uses the numbers of PX4 where PX4 flies', () => {
    hears(fromAutopilot('HEARTBEAT', { autopilot: 12, type: 2, custom_mode: 0, base_mode: 81 }));
    void vehicle.sendHold();
    expect(commandsSent()).toMatchObject([{ param1: 1, param2: 4, param3: 3 }]);
  });

  it.each([MAV_AUTOPILOT.ARDUPILOTMEGA, MAV_AUTOPILOT.PX4])('needs nobody at the sticks of autopilot %i', (one) => {
    expect(modeSetOf(one, null)?.hold.obeysSticks).toBe(false);
  });
});
