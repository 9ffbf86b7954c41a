import { describe, expect, it } from 'vitest';

import { fieldsOf, fieldLabel, fieldUnit, usualFields } from '../../src/frames/chart_field';
import { fieldTexts } from '../../src/frames/field_text';
import { keepFrames } from '../../src/frames/live_frames';
import { MessageRates } from '../../src/frames/message_rates';
import { Vehicle } from '../../src/link/vehicle';
import { A_DRONE, FakeClock } from '../link/fakes';
import { said, sent } from './recorded';

const aVehicle = (): Vehicle =>
  new Vehicle(
    A_DRONE,
    new FakeClock(),
    { command: () => new Promise(() => undefined), send: () => true, sendFresh: () => 'sent', alerts: () => [] },
    () => undefined,
  );

describe('the last minutes of a drone', () => {
  it('hold every frame that came, decoded or not, until they are let go', () => {
    const vehicle = aVehicle();
    const { log, stop } = keepFrames(vehicle);
    vehicle.receive(said('HEARTBEAT', { type: 2, autopilot: 3 }), 1_000);
    vehicle.receive(Uint8Array.from([0xfd, 1, 0, 0, 0, 1, 1, 0xff, 0xff, 0xee, 9, 0, 0]), 1_010);
    stop();
    vehicle.receive(said('HEARTBEAT', {}), 2_000);
    expect(log.end).toBe(2);
    expect(log.kinds.map(({ msgid }) => msgid)).toEqual([0, 0xeeffff]);
  });

  it('are counted by kind and second', () => {
    const { log } = keepFrames(aVehicle());
    const rates = new MessageRates();
    const frame = said('ATTITUDE', { roll: 1 });
    for (let step = 0; step <= 200; step++) {
      if (step % 10 === 0) rates.take(log.kinds, step * 50);
      log.push(step * 50, frame, 0, frame.length);
    }
    expect(rates.perSecond(0)).toBeCloseTo(20, 0);
    expect(new MessageRates().perSecond(0)).toBeNull();
  });
});

describe('fields', () => {
  it('are read with their units', () => {
    const position = said('GLOBAL_POSITION_INT', { lat: 473_977_000, relative_alt: -1500, hdg: 9000 });
    const text = Object.fromEntries(fieldTexts(33, position).map((one) => [one.name, one.text]));
    expect(text).toMatchObject({ lat: '47.3977 °', relative_alt: '-1.5 m', hdg: '90 °' });
    expect(fieldTexts(253, said('STATUSTEXT', { severity: 4, text: 'Größe' }))[1]).toEqual({
      name: 'text',
      text: 'Größe',
      isNumeric: false,
    });
    expect(fieldTexts(0xeeffff, position)).toEqual([]);
  });

  it('of arrays are one number each, and texts are none', () => {
    const from = { sysid: 1, compid: 1, count: 1, last: 0 };
    const cells = fieldsOf({ ...from, msgid: 147 }).filter(({ field }) => field === 'voltages');
    expect(cells).toHaveLength(10);
    expect(fieldLabel(cells[3]!)).toBe('BATTERY_STATUS voltages[3]');
    expect(fieldUnit(cells[3]!)).toEqual({ unit: 'V', factor: 0.001 });
    expect(fieldsOf({ ...from, msgid: 253 }).map(({ field }) => field)).not.toContain('text');
    expect(usualFields([{ ...from, msgid: 33 }]).map(fieldLabel)).toEqual(['GLOBAL_POSITION_INT relative_alt']);
    expect(sent('HEARTBEAT', {})[5]).toBe(255);
  });
});
