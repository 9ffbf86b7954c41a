import { describe, expect, it } from 'vitest';

import { flightValues } from '../../src/link/flight_values';
import { Telemetry } from '../../src/link/telemetry';
import { fromAutopilot, heartbeat } from '../link/fakes';

const BESIDE = { online: true, armed: true, target: null, link: null, airborneSinceMs: null, batteryTime: null };

function heard(): Telemetry {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(4), 0);
  return telemetry;
}

function gps(telemetry: Telemetry, name: 'GPS_RAW_INT' | 'GPS2_RAW', atMs: number, fix: number, count: number): void {
  telemetry.receive(fromAutopilot(name, { fix_type: fix, satellites_visible: count }), atMs);
}
const shown = (telemetry: Telemetry, nowMs: number): unknown[] => {
  const { gpsFix, gpsNumber, satellites } = flightValues(telemetry, BESIDE, nowMs);
  return [gpsFix, gpsNumber, satellites];
};

describe('of several GPS', () => {
  it('one alone has no number', () => {
    const telemetry = heard();
    gps(telemetry, 'GPS_RAW_INT', 1_000, 3, 12);
    expect(shown(telemetry, 1_000)).toEqual(['3D', null, 12]);
  });

  it('the worst is shown with its own figures', () => {
    const telemetry = heard();
    gps(telemetry, 'GPS_RAW_INT', 1_000, 3, 12);
    gps(telemetry, 'GPS2_RAW', 1_000, 1, 4);
    expect(shown(telemetry, 1_000)).toEqual(['no fix', 2, 4]);
    gps(telemetry, 'GPS2_RAW', 2_000, 3, 14);
    expect(shown(telemetry, 2_000)).toEqual(['3D', 1, 12]);
  });

  it('one that reports no more is gone, and the last known stays of a silent drone', () => {
    const telemetry = heard();
    gps(telemetry, 'GPS2_RAW', 1_000, 1, 4);
    gps(telemetry, 'GPS_RAW_INT', 62_000, 3, 12);
    expect(shown(telemetry, 62_000)).toEqual(['3D', null, 12]);
    expect(shown(telemetry, 400_000)).toEqual(['3D', null, 12]);
  });
});
