import { describe, expect, it } from 'vitest';

import { flightValues, type FlightValues } from '../../src/link/flight_values';
import { Telemetry } from '../../src/link/telemetry';
import { TROUBLES, troubleOf } from '../../src/link/trouble';
import type { Drone } from '../../src/link/wire_types';
import { A_DRONE, A_HOLD, heartbeat } from './fakes';

const HELD: Drone = { ...A_DRONE, holder: { id: 5, name: 'olga' } };
const BESIDE = { online: true, armed: false, target: null, link: null, airborneSinceMs: null, batteryTime: null };

function kind(drone: Partial<Drone>, changes: Partial<FlightValues> = {}, wasAirborne = true): string | null {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(4), 0);
  const values = { ...flightValues(telemetry, BESIDE, 0), airborne: true, ...changes };
  return troubleOf({ ...HELD, ...drone }, values, wasAirborne)?.kind ?? null;
}

describe('the trouble of a drone', () => {
  it.each<[string | null, Partial<Drone>, Partial<FlightValues>]>([
    [null, {}, {}],
    ['link-lost', { online: false }, { batteryCharge: 3, state: 'lost' }],
    ['silent', {}, { state: 'lost' }],
    ['battery-critical', {}, { batteryCharge: 3, state: 'alert' }],
    ['battery-low', {}, { batteryCharge: 2, state: 'alert' }],
    ['emergency', {}, { state: 'alert' }],
    ['counting', { hold: { ...A_HOLD, phase: 'counting' } }, {}],
    ['unattended', { holder: null }, {}],
  ])('is its worst: %s', (expected, drone, values) => {
    expect(kind(drone, values)).toBe(expected);
  });

  it('is no lost link of a drone that was switched off on the ground', () => {
    expect(kind({ online: false }, { state: 'lost' }, false)).toBeNull();
    expect(kind({}, { state: 'lost' }, false)).toBeNull();
  });

  it('ranks a low battery on the ground behind everything in the air', () => {
    const telemetry = new Telemetry();
    telemetry.receive(heartbeat(4), 0);
    const values = { ...flightValues(telemetry, BESIDE, 0), airborne: false, batteryCharge: 2 };
    expect(troubleOf(HELD, values, false)).toMatchObject({ kind: 'battery-low', rank: TROUBLES.length });
  });
});
