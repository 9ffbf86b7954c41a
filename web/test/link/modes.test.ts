import { describe, expect, it } from 'vitest';

import { COPTER_MODE, MAV_AUTOPILOT, MAV_TYPE } from '../../src/link/generated/mavlink.gen';
import { flightTask, holdModeOf, holdRungs, modeName, modeSetOf, whyNot, type FlightTask } from '../../src/link/modes';

const { ARDUPILOTMEGA, PX4, INVALID } = MAV_AUTOPILOT;
const px4 = (main: number, sub = 0): number => ((main << 16) | (sub << 24)) >>> 0;

describe('what a drone does in a mode', () => {
  it.each<[number, number, FlightTask | null]>([
    [ARDUPILOTMEGA, COPTER_MODE.AUTO, 'mission'],
    [ARDUPILOTMEGA, COPTER_MODE.RTL, 'return'],
    [ARDUPILOTMEGA, COPTER_MODE.SMART_RTL, 'return'],
    [ARDUPILOTMEGA, COPTER_MODE.AUTO_RTL, 'return'],
    [ARDUPILOTMEGA, COPTER_MODE.LAND, 'landing'],
    [ARDUPILOTMEGA, COPTER_MODE.LOITER, 'by-hand'],
    [ARDUPILOTMEGA, COPTER_MODE.BRAKE, 'by-itself'],
    [ARDUPILOTMEGA, COPTER_MODE.FLIP, null],
    [PX4, px4(4, 4), 'mission'],
    [PX4, px4(4, 5), 'return'],
    [PX4, px4(4, 6), 'landing'],
    [PX4, px4(4, 9), 'landing'],
    [PX4, px4(3), 'by-hand'],
    [PX4, px4(4, 3), 'by-itself'],
    // The number of ArduCopter's AUTO and of no mode of PX4.
    [PX4, COPTER_MODE.AUTO, null],
    [INVALID, COPTER_MODE.RTL, null],
  ])('of autopilot %i, %i: %s', (autopilot, customMode, task) => {
    expect(flightTask(autopilot, customMode, null)).toBe(task);
  });

  it('is not known before anything was heard', () => {
    expect(flightTask(null, null, null)).toBeNull();
  });
});

it('names a precision landing, which nobody can choose', () => {
  expect(modeName(PX4, px4(4, 9), null)).toBe('PRECISION LAND');
  expect(modeSetOf(PX4, null)?.modes.map(({ name }) => name)).not.toContain('PRECISION LAND');
});

describe('profiles', () => {
  const { QUADROTOR, FIXED_WING } = MAV_TYPE;

  it('name the modes of the vehicle that it is', () => {
    expect(modeName(ARDUPILOTMEGA, 11, FIXED_WING)).toBe('RTL');
    expect(modeName(ARDUPILOTMEGA, 11, QUADROTOR)).toBe('DRIFT');
    expect(modeName(PX4, px4(3), QUADROTOR)).toBe('POSITION');
  });

  it('offer nothing to choose for a vehicle that is only watched', () => {
    expect(modeSetOf(ARDUPILOTMEGA, FIXED_WING)).toBeNull();
    expect(modeSetOf(ARDUPILOTMEGA, QUADROTOR)?.hold.name).toBe('BRAKE');
  });

  it('hold each kind of vehicle in a mode of its own, or in none', () => {
    const { GROUND_ROVER, SUBMARINE, VTOL_QUADROTOR } = MAV_TYPE;
    expect(holdModeOf(ARDUPILOTMEGA, QUADROTOR)?.name).toBe('BRAKE');
    expect(holdModeOf(ARDUPILOTMEGA, FIXED_WING)?.name).toBe('LOITER');
    expect(holdModeOf(ARDUPILOTMEGA, FIXED_WING)?.customMode).toBe(12);
    // 17, ArduCopter's BRAKE, is QSTABILIZE on a VTOL.
    expect(holdModeOf(ARDUPILOTMEGA, VTOL_QUADROTOR)?.customMode).toBe(12);
    for (const type of [GROUND_ROVER, SUBMARINE]) expect(holdModeOf(ARDUPILOTMEGA, type)).toBeNull();
    expect(holdModeOf(PX4, FIXED_WING)).toBeNull();
  });

  it('say what an autopilot cannot do, and why', () => {
    expect(whyNot('orbit', ARDUPILOTMEGA, null)).toBe('ArduCopter circles a place in missions only: plan it');
    expect(whyNot('turn', PX4, null)).toBeNull();
    expect(whyNot('takeoff', ARDUPILOTMEGA, FIXED_WING)).toMatch(/watched and returned only/);
    expect(whyNot('rtl', ARDUPILOTMEGA, FIXED_WING)).toBeNull();
  });

  it('have the rungs of a hold, of all autopilots while none is known', () => {
    expect(holdRungs(ARDUPILOTMEGA)).toEqual(['LOITER', 'POSHOLD', 'BRAKE']);
    expect(holdRungs(PX4)).toEqual(['AUTO.LOITER', 'POSCTL']);
    expect(holdRungs(null)).toEqual(['LOITER', 'POSHOLD', 'BRAKE', 'AUTO.LOITER', 'POSCTL']);
  });
});
