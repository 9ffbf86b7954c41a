import { describe, expect, it } from 'vitest';

import { conditionsOf, isUnattended } from '../../src/link/conditions';
import { flightValues, type FlightValues } from '../../src/link/flight_values';
import { Telemetry } from '../../src/link/telemetry';
import type { Drone, HoldView } from '../../src/link/wire_types';
import { A_DRONE, A_HOLD, fromAutopilot, heartbeat } from './fakes';

const HELD: Drone = { ...A_DRONE, holder: { id: 5, name: 'olga' } };
const BESIDE = { online: true, armed: false, target: null, link: null, airborneSinceMs: null, batteryTime: null };
const FLYING: Partial<FlightValues> = { state: 'flying', airborne: true };

function values(changes: Partial<FlightValues> = {}): FlightValues {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(4), 0);
  return { ...flightValues(telemetry, BESIDE, 0), ...changes };
}
const ids = (drone: Drone, now: FlightValues, wasAirborne = false): string[] =>
  conditionsOf(drone, now, wasAirborne).map(({ id, severity }) => `${id}:${severity}`);

describe('what wants attention', () => {
  it.each([
    ['nothing, idle and well', HELD, {}, []],
    ['a battery that is low', HELD, { batteryPercent: 30 }, ['battery-low:warning']],
    ['a battery near its end, once', HELD, { batteryPercent: 12 }, ['battery-critical:critical']],
    ['an emergency', HELD, { state: 'alert' }, ['emergency:critical']],
    ['an estimator that fails in the air', HELD, { ...FLYING, ekfIsHealthy: false }, ['ekf:critical']],
    ['no estimator that is not ready on the ground', HELD, { ekfIsHealthy: false }, []],
    ['a lost GPS in the air', HELD, { ...FLYING, gpsFix: 'no fix' }, ['gps:warning']],
    ['nobody at the controls in the air', A_DRONE, FLYING, ['unattended:warning']],
    ['a position that jumps', { ...HELD, suspicious_motion: 'jump' }, FLYING, ['motion:warning']],
    ['a position that is well', { ...HELD, suspicious_motion: null }, FLYING, []],
  ] as const)('%s', (_, drone, changes, expected) => {
    expect(ids(drone, values(changes))).toEqual(expected);
  });

  it('a link that is lost in the air; on the ground it is no news', () => {
    const away = { ...HELD, online: false };
    expect(ids(away, values(), true)).toEqual(['link-lost:critical']);
    expect(conditionsOf(away, values(), true)[0]!.text).toBe(
      'Link lost while in the air. It was in GUIDED; its agent will return it after 30 s without the tower (if its agent is alive).',
    );
    expect(ids(away, values(), false)).toEqual([]);
  });

  it('a countdown that begins, and the action at its end', () => {
    const now = values();
    const said = (changes: Partial<HoldView>): string[] =>
      conditionsOf({ ...HELD, hold: { ...A_HOLD, ...changes } }, now, true).map(
        ({ id, severity, text }) => `${id}:${severity}: ${text}`,
      );
    expect(said({})).toEqual([
      'lost-action-counting:warning: Nobody flies it. It returns at 00:17:04 UTC, unless somebody flies it or says "stay".',
    ]);
    expect(said({ lost: 'tower', action: 'land' })).toEqual([
      'lost-action-counting:warning: It has lost the tower. It lands at 00:17:04 UTC.',
    ]);
    expect(said({ due_at: null, action: null })[0]).toContain('Nobody flies it. It acts by itself soon');
    for (const phase of ['asking', 'done'] as const) {
      expect(said({ phase, due_at: null })).toEqual(['lost-action:warning: It returns: nobody flew it.']);
    }
    expect(said({ phase: 'stayed' })).toEqual([]);
    expect(said({ phase: 'quiet', lost: null })).toEqual([]);
  });

  it('an autopilot that is not heard any more', () => {
    expect(ids(HELD, values({ state: 'lost', heartbeatAgeMs: 9_000 }), true)).toEqual(['autopilot-silent:critical']);
    expect(ids(HELD, values({ state: 'lost', heartbeatAgeMs: null }))).toEqual([]);
  });
});

it('is unattended by the word of the agent too', () => {
  expect(isUnattended({ ...A_DRONE, airborne: true }, { airborne: false })).toBe(true);
  expect(isUnattended(HELD, { airborne: true })).toBe(false);
});

it('reads the health of the estimator', () => {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(4), 0);
  const healthy = (): boolean | null => flightValues(telemetry, BESIDE, 0).ekfIsHealthy;
  expect(healthy()).toBeNull();
  telemetry.receive(fromAutopilot('EKF_STATUS_REPORT', { flags: 0x33f, velocity_variance: 0.1 }), 0);
  expect(healthy()).toBe(true);
  telemetry.receive(fromAutopilot('EKF_STATUS_REPORT', { flags: 0x33f, compass_variance: 0.9 }), 0);
  expect(healthy()).toBe(false);
});
