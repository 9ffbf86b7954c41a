import { describe, expect, it } from 'vitest';

import { flightValues, type FlightValues } from '../../src/link/flight_values';
import { readHold } from '../../src/link/hold_view';
import { lastHeard, type Silence } from '../../src/link/loss_countdown';
import { Telemetry } from '../../src/link/telemetry';
import { batteryCell, linkCell, stateCell, type BarFacts } from '../../src/words/flight_bar_words';
import { A_DRONE, A_HOLD, heartbeat } from '../link/fakes';

const BESIDE = { online: true, armed: true, target: null, link: null, airborneSinceMs: null, batteryTime: null };
const NOW_MS = 20_000;

function values(changes: Partial<FlightValues> = {}): FlightValues {
  const telemetry = new Telemetry();
  telemetry.receive(heartbeat(4), NOW_MS);
  return { ...flightValues(telemetry, BESIDE, NOW_MS), armed: true, airborne: true, state: 'flying', ...changes };
}
const FACTS: BarFacts = {
  drone: A_DRONE,
  values: values(),
  hold: null,
  silence: null,
  missionPhase: 'elsewhere',
  holdSinceMs: null,
  modeSinceMs: 13_000,
  cause: '',
  nowMs: NOW_MS,
};
const state = (changes: Partial<BarFacts>): string[] => {
  const { text, detail, tone } = stateCell({ ...FACTS, ...changes });
  return [text, detail, tone];
};
const BRAKE = 17;

describe('what the bar says of a drone', () => {
  it('in a mode of its own', () => {
    expect(state({})).toEqual(['GUIDED', '', '']);
    expect(state({ missionPhase: 'flown' })[1]).toBe('flies its mission');
    expect(state({ values: values({ airborne: false }) })[1]).toBe('motors running, on the ground');
  });

  it('whose mode nobody commanded: why', () => {
    const rtl = values({ mode: 'RTL', state: 'alert' });
    expect(state({ values: rtl, cause: 'Battery Failsafe, 13.3 V' })).toEqual([
      'RTL',
      'Battery Failsafe, 13.3 V',
      'danger',
    ]);
    expect(state({ values: values({ mode: 'RTL', airborne: false }), cause: 'Battery Failsafe' })[1]).not.toContain(
      'Failsafe',
    );
  });

  it('that nobody has the controls of: who let it go', () => {
    const held = { ...A_HOLD, nobody_because: 'anna released the controls' };
    const hold = readHold(held, { droneName: 'Heron', lostActionS: 30, towerLagMs: 0 }, NOW_MS);
    expect(state({ drone: { ...A_DRONE, hold: held }, hold })[1]).toContain('; anna released the controls');
  });

  it('that a pilot put on hold: for how long', () => {
    const brake = values({ customMode: BRAKE, mode: 'BRAKE' });
    expect(state({ values: brake })).toEqual(['HOLD 00:07', 'BRAKE: stays here until you fly on', 'good']);
    expect(state({ values: brake, missionPhase: 'paused' })[1]).toContain('mission paused');
  });

  it('that holds because nobody flies it: what comes next', () => {
    const held = { ...A_HOLD, due_at: new Date(NOW_MS + 12_000).toISOString() };
    const hold = readHold(held, { droneName: 'Heron', lostActionS: 30, towerLagMs: 0 }, NOW_MS);
    const [text, detail, tone] = state({ drone: { ...A_DRONE, hold: held }, hold, holdSinceMs: 2_000 });
    expect(text).toBe('HOLD 00:18');
    expect(detail).toContain('12 s');
    expect(tone).toBe('warning');
  });

  it.each([
    ['in its mission', 'mission', 'goes on with its mission; returns in 20 s'],
    ['by hand', 'by-hand', 'flown by hand: holds; returns in 20 s'],
    ['on its way home', 'return', 'returning'],
  ] as const)('whose link is lost %s', (_, task, expected) => {
    const last = lastHeard(A_DRONE, values({ task, mode: 'as heard' }), true);
    const silence: Silence = { ...last, whose: 'drone', sinceMs: 10_000, towerLagMs: 0 };
    expect(state({ silence })).toEqual(['LINK LOST 00:10', expected, 'danger']);
    expect(state({ silence: { ...silence, whose: 'own' } })[0]).toBe('TOWER LOST 00:10');
    expect(state({ silence: { ...silence, isAirborne: false }, drone: { ...A_DRONE, online: false } })[0]).toBe(
      'Offline',
    );
  });
});

describe('the battery in the bar', () => {
  it('is low by its voltage: no time that its gauge promises stands beside that', () => {
    const low = values({ batteryPercent: 93, batteryCharge: 2, batteryV: 13.34 });
    expect(batteryCell(low, { afterMs: 1_150_000, wayMs: 1 })).toEqual({
      text: '13.3 V low',
      detail: 'its gauge says 93 %',
      tone: 'warning',
    });
    expect(batteryCell({ ...low, batteryCharge: 3 }, { afterMs: 1_150_000, wayMs: 1 })).toMatchObject({
      text: '13.3 V critical',
      tone: 'danger',
    });
    expect(batteryCell({ ...low, batteryPercent: 28 }, { afterMs: 150_000, wayMs: 1 })).toMatchObject({
      text: '28 % low',
      detail: '02:30 left at home',
    });
    expect(batteryCell(low, { afterMs: -1, wayMs: 1 }).detail).toBe('NOT enough for home');
  });

  it('says the time after the way home, or that it is unknown', () => {
    const now = values({ batteryPercent: 64 });
    expect(batteryCell(now, { afterMs: 492_000, wayMs: 1 })).toEqual({
      text: '64 %',
      detail: '08:12 left at home',
      tone: '',
    });
    expect(batteryCell(now, { afterMs: null, why: '' }).detail).toBe('left at home: unknown');
    expect(batteryCell(now, { afterMs: -1, wayMs: 1 })).toMatchObject({
      detail: 'NOT enough for home',
      tone: 'danger',
    });
    expect(batteryCell(now, { afterMs: 30_000, wayMs: 1 }).tone).toBe('warning');
    expect(batteryCell({ ...now, batteryCharge: 2 }, { afterMs: null, why: '' })).toMatchObject({
      text: '64 % low',
      tone: 'warning',
    });
  });
});

describe('the link in the bar', () => {
  it('says its age once that is news', () => {
    const now = values({ linkRttMs: 42, linkLossPercent: 1 });
    expect(linkCell(now, null, false)).toEqual({ text: '42 ms', detail: '1 % lost', tone: '' });
    const old = { ...now, heartbeatAgeMs: 4_000, positionAgeMs: 6_000 };
    expect(linkCell(old, null, false)).toMatchObject({ text: '4 s old', tone: 'danger' });
  });
});
